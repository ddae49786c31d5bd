//! `.ifcZIP`.

use enfilade::scene::ImportOptions;
use std::io::Write;
use testing::house::House;

/// A zip archive with these files, deflated, as its specification (APPNOTE) lays it out.
fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in files {
        let mut deflated = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::best());
        deflated.write_all(bytes).unwrap();
        let (deflated, mut crc) = (deflated.finish().unwrap(), flate2::Crc::new());
        crc.update(bytes);
        let word = |n: usize| (n as u32).to_le_bytes();
        // Version, flags, method, time, date; checksum, sizes, length of the name, of what is extra.
        let sizes = [crc.sum().to_le_bytes(), word(deflated.len()), word(bytes.len()), word(name.len())].concat();
        let head = [&[20, 0, 0, 0, 8, 0, 0, 0, 0x21, 0][..], &sizes].concat();
        directory.extend([&b"PK\x01\x02\x14\0"[..], &head, &[0; 10], &word(out.len()), name.as_bytes()].concat());
        out.extend([&b"PK\x03\x04"[..], &head, name.as_bytes(), &deflated].concat());
    }
    let (start, count) = (out.len() as u32, files.len() as u8);
    out.extend(&directory);
    out.extend([&b"PK\x05\x06\0\0\0\0"[..], &[count, 0, count, 0], &(directory.len() as u32).to_le_bytes()].concat());
    out.extend([&start.to_le_bytes()[..], &[0; 2]].concat());
    out
}

#[test]
fn zipped_files_are_read_as_what_is_in_them() {
    let folder = crate::cli::folder("ifczip");
    let text = House::default().text();
    let (plain, zipped) = (folder.join("house.ifc"), folder.join("house.ifcZIP"));
    std::fs::write(&plain, &text).unwrap();
    let options = ImportOptions::default();
    let of_zip = |bytes: &[u8]| {
        std::fs::write(&zipped, bytes).unwrap();
        enfilade_formats::import(&zipped, &options)
    };
    let scene = of_zip(&archive(&[("read me.txt", b"a house"), ("model/House.IFC", text.as_bytes())])).unwrap();
    assert_eq!(scene, enfilade_formats::import(&plain, &options).unwrap());

    let good = archive(&[("house.ifc", text.as_bytes())]);
    let mut other = good.clone();
    other[40] ^= 0x55;
    for (bytes, why) in [
        (text.as_bytes(), "not a zip archive"),
        (&archive(&[("house.txt", text.as_bytes())]), "no .ifc file in the archive"),
        (&other, "archive"),
        (
            &archive(&[("house.ifc", &vec![b' '; 10_000_000])]),
            "its .ifc file is more than 200 times larger than the archive",
        ),
    ] {
        let error = of_zip(bytes).unwrap_err().to_string();
        assert!(error.contains(why) && !error.contains('\n'), "{error}");
    }
}
