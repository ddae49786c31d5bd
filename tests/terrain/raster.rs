//! Rasters against facts known otherwise: files by hand, and real ones whose sizes, voids and ranges are told beside them.

use crate::cli::folder;
use enfilade_scenes::ground;
use enfilade_terrain::raster::{Raster, RasterError, RasterOptions};
use std::path::PathBuf;
use testing::bakes;
use testing::data::data;
use testing::tiffs::Tiff;

const PLAIN: RasterOptions = RasterOptions { spacing: None };

fn open(name: &str, bytes: Vec<u8>) -> Result<Raster, RasterError> {
    Raster::from_bytes(name, bytes, &PLAIN)
}

fn all(raster: &mut Raster) -> Vec<f64> {
    let [columns, rows] = raster.size();
    let mut heights = vec![0.0; columns as usize * rows as usize];
    raster.read(0..rows, &mut heights).unwrap();
    heights
}

fn same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b || a.is_nan() && b.is_nan())
}

/// In metres of a plane: 30 m cells, the corner at 500,000 m east and 5,300,000 m north.
fn placed(tiff: Tiff) -> Tiff {
    tiff.doubles(33550, &[30.0, 30.0, 0.0])
        .doubles(33922, &[0.0, 0.0, 0.0, 500_000.0, 5_300_000.0, 0.0])
        .shorts(34735, &[1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3076, 0, 1, 9001])
}

/// The message of a refusal: one line that begins with the file.
fn refused(name: &str, bytes: Vec<u8>) -> String {
    let read = |mut raster: Raster| {
        let [columns, rows] = raster.size();
        raster.read(0..rows, &mut vec![0.0; columns as usize * rows as usize])
    };
    let line = open(name, bytes).and_then(read).expect_err(name).to_string();
    assert!(line.starts_with(&format!("{name}: ")) && !line.contains('\n'), "{line}");
    line
}

#[test]
fn a_tiff_by_hand_is_read_however_it_is_stored() {
    let heights: Vec<i16> = (0..340).map(|i| (i * 37 % 1009) as i16 - 300).collect();
    let wanted: Vec<f64> = heights.iter().map(|&h| if h == -300 { f64::NAN } else { f64::from(h) }).collect();
    for (tile, packed, predictor, big) in [
        (None, false, 0, false),
        (None, false, 0, true),
        (None, true, 2, false),
        (Some([16, 16]), false, 0, false),
        (Some([16, 16]), true, 2, true),
        (Some([32, 32]), true, 0, false),
    ] {
        let tiff = Tiff { tile, packed, predictor, big, ..Tiff::wholes([20, 17], &heights) };
        let mut tiff = placed(tiff);
        tiff.tags.push((42113, 2, b"-300\0".to_vec()));
        let mut raster = open("a.tif", tiff.bytes()).unwrap();
        assert_eq!((raster.size(), raster.spacing(), raster.first()), ([20, 17], [30.0; 2], [500_015.0, 5_299_985.0]));
        assert_eq!((raster.lattice(), raster.notes()), (Some(1.0), &[][..]));
        assert!(same(&all(&mut raster), &wanted), "{tile:?} {packed} {predictor} {big}");
        let mut windows = vec![0.0; 340];
        for rows in [0..5, 5..6, 6..17] {
            raster.read(rows.clone(), &mut windows[20 * rows.start as usize..20 * rows.end as usize]).unwrap();
        }
        assert!(same(&windows, &wanted));
    }
}

#[test]
fn a_bigtiff_and_lzw_are_read() {
    let heights: Vec<i16> = (0..6400).map(|i| (i * i % 3001) as i16 - 1500).collect();
    let wanted: Vec<f64> = heights.iter().map(|&h| f64::from(h)).collect();
    for (tile, lzw, predictor, large, big) in [
        (None, false, 0, true, false),
        (None, false, 0, true, true),
        (Some([16, 16]), false, 0, true, false),
        (None, true, 0, false, false),
        (None, true, 2, true, true),
        (Some([32, 48]), true, 2, false, false),
    ] {
        let tiff = Tiff { tile, lzw, predictor, large, big, ..Tiff::wholes([80, 80], &heights) };
        let mut raster = open("a.tif", placed(tiff).bytes()).unwrap();
        assert_eq!((raster.size(), raster.first()), ([80, 80], [500_015.0, 5_299_985.0]));
        assert!(same(&all(&mut raster), &wanted), "{tile:?} {lzw} {predictor} {large} {big}");
    }
}

#[test]
fn floats_are_read_with_their_predictor() {
    let heights: Vec<f32> =
        (0..1400).map(|i| 100.0 + 0.37 * (i * i % 997) as f32 - if i == 7 { 1e-3 } else { 0.0 }).collect();
    let wanted: Vec<f64> = heights.iter().map(|&h| f64::from(h)).collect();
    for (tile, packed, lzw, big) in [
        (None, true, false, false),
        (None, false, true, true),
        (Some([16, 32]), true, false, true),
        (None, false, false, false),
    ] {
        let tiff = Tiff { tile, packed, lzw, big, predictor: 3, ..Tiff::floats([40, 35], &heights) };
        assert!(same(&all(&mut open("a.tif", tiff.bytes()).unwrap()), &wanted), "{tile:?} {packed} {lzw} {big}");
    }
}

/// Nothing of such a raster is in the file: its strip is left out.
#[test]
fn more_samples_than_are_read_are_refused() {
    let sized = |size: [u32; 2]| {
        let mut tiff = Tiff::wholes([2, 2], &[0; 4]);
        for (tag, value) in [(256, size[0]), (257, size[1]), (278, size[1]), (273, 0), (279, 0)] {
            tiff.tags.push((tag, 4, value.to_le_bytes().to_vec()));
        }
        tiff.bytes()
    };
    for [columns, rows] in [[50_000, 42_950], [1 << 20, 2049], [2, (1 << 20) + 1], [(1 << 20) + 1, 2]] {
        let line =
            format!("a.tif: {columns} x {rows} samples; at most 2^31 are supported, and 2^20 on a side: cut it into parts");
        assert_eq!(open("a.tif", sized([columns, rows])).expect_err("too large").to_string(), line);
    }
    // 2^31 to the sample: it is opened, and its rows are voids or 0.
    let mut raster = open("a.tif", sized([1 << 16, 1 << 15])).unwrap();
    let mut row = vec![1.0; 1 << 16];
    raster.read(32_767..32_768, &mut row).unwrap();
    assert!(row.iter().all(|&h| h == 0.0));
}

#[test]
fn what_is_no_number_is_void() {
    let floats = Tiff::floats([2, 2], &[1.5, f32::NAN, f32::INFINITY, -9999.0]);
    let mut raster = open("a.tif", Tiff { tags: vec![(42113, 2, b"-9999\0".to_vec())], ..floats }.bytes()).unwrap();
    assert!(same(&all(&mut raster), &[1.5, f64::NAN, f64::NAN, f64::NAN]));
    assert_eq!(raster.lattice(), None);
    assert_eq!(raster.notes(), ["a.tif: no georeference: 1 m a sample, assumed"]);
    let given = RasterOptions { spacing: Some(2.5) };
    let raster = Raster::from_bytes("a.tif", Tiff::wholes([2, 2], &[0; 4]).bytes(), &given).unwrap();
    assert_eq!((raster.spacing(), raster.first()), ([2.5; 2], [0.0; 2]));
}

#[test]
fn units_and_scales_are_converted() {
    let tiff = |keys: &[u16]| {
        Tiff::wholes([2, 2], &[0, 10, 20, 30])
            .doubles(33550, &[100.0, 100.0, 0.0])
            .doubles(33922, &[0.0, 0.0, 0.0, 1000.0, 2000.0, 0.0])
            .shorts(34735, keys)
    };
    // A point; US survey feet of 1200/3937 m; heights in feet.
    let keys = [1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 2, 3076, 0, 1, 9003, 4099, 0, 1, 9002];
    let mut raster = open("a.tif", tiff(&keys).bytes()).unwrap();
    assert!((raster.spacing()[0] - 30.480_060_960).abs() < 1e-9 && (raster.first()[1] - 609.601_219_2).abs() < 1e-6);
    assert!((all(&mut raster)[1] - 3.048).abs() < 1e-12);
    // Arizona is in feet, by the number of its system; the unit is not stated.
    let raster = open("a.tif", tiff(&[1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 2223]).bytes()).unwrap();
    assert!((raster.spacing()[0] - 30.48).abs() < 1e-9);
    assert_eq!(raster.notes().len(), 2, "{:?}", raster.notes());
    let xml = b"<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.5</Item></GDALMetadata>\0".to_vec();
    let scaled = Tiff { tags: vec![(42112, 2, xml)], ..Tiff::wholes([2, 2], &[0, 1, 2, 3]) };
    let mut raster = open("a.tif", scaled.bytes()).unwrap();
    assert_eq!((all(&mut raster), raster.lattice()), (vec![0.0, 0.5, 1.0, 1.5], Some(0.5)));
}

#[test]
fn bad_tiffs_are_refused_in_one_line() {
    let heights = [5i16; 340];
    let tiff = || Tiff::wholes([20, 17], &heights);
    let short = |tag: u16, value: u16| tiff().shorts(tag, &[value]).bytes();
    for (value, says) in [
        (50000, "compression 50000 (ZSTD)"),
        (7, "compression 7 (JPEG) is not supported; write it again: gdal_translate"),
        (999, "compression 999"),
    ] {
        assert!(refused("a.tif", short(259, value)).contains(says));
    }
    assert!(refused("a.tif", short(258, 12)).contains("a sample of 12 bits (signed, format 2)"));
    assert!(refused("a.tif", short(277, 3)).contains("a raster of 3 samples a pixel"));
    let scale = |x: f64| placed(tiff()).doubles(33550, &[x, 30.0, 0.0]).bytes();
    for x in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let line = refused("a.tif", scale(x));
        assert!(line.contains("a pixel scale of") && line.ends_with("it must be finite and above 0: write the file again"));
    }
    let turned = [30.0, 1.0, 0.0, 5.0, 0.0, -30.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    assert!(
        refused("a.tif", tiff().doubles(34264, &turned).bytes())
            .contains("a rotated raster (ModelTransformation) is not supported; ")
    );
    let mut north_up = turned;
    north_up[1] = 0.0;
    assert_eq!(open("a.tif", tiff().doubles(34264, &north_up).bytes()).unwrap().first(), [20.0, -10.0]);
    let mut large = tiff();
    large.tags.extend([256, 257].map(|tag| (tag, 4, 1_000_000u32.to_le_bytes().to_vec())));
    assert!(refused("a.tif", large.bytes()).contains("strip") || refused("a.tif", large.bytes()).contains("2^31"));
    let none = refused("a.tif", b"PK\x03\x04 no tiff".to_vec());
    assert!(none.contains("not a TIFF: it begins with neither II nor MM; give a GeoTIFF"), "{none}");
    for packed in [false, true] {
        let whole = Tiff { packed, tile: Some([16, 16]), ..tiff() }.bytes();
        for length in 0..whole.len() {
            let line = refused("a.tif", whole[..length].to_vec());
            assert!(length > 0 || line.ends_with("cut off: the file ends at byte 0; copy it again"), "{line}");
        }
    }
    let huge = Tiff::floats([1, 1], &[-3.4e38]).bytes();
    assert!(refused("a.tif", huge).contains("no-data value"));
    assert!(refused("a.png", tiff().bytes()).contains("no reader for \".png\"; give .tif, .hgt or .asc"));
}

#[test]
fn srtm_tiles_have_their_corner_from_their_name() {
    let bytes: Vec<u8> = [1i16, 2, 3, 4, -32768, 6, 7, 8, 9].iter().flat_map(|h| h.to_be_bytes()).collect();
    let mut raster = open("N34W119.hgt", bytes.clone()).unwrap();
    assert!(same(&all(&mut raster), &[1.0, 2.0, 3.0, 4.0, f64::NAN, 6.0, 7.0, 8.0, 9.0]));
    // A degree of latitude at 34.5 degrees: 110,931 m by tables of WGS 84, half of which is between two rows; of longitude: 91,831 m.
    let [x, y] = raster.spacing();
    assert!((y - 110_931.0 / 2.0).abs() < 10.0 && (x - 91_831.0 / 2.0).abs() < 30.0, "{x} {y}");
    assert!((raster.first()[1] / raster.spacing()[1] - 70.0).abs() < 1e-9);
    assert!((raster.first()[0] / raster.spacing()[0] + 238.0).abs() < 1e-9);
    assert!(raster.notes()[0].contains("34.5"));
    assert!(open("elsewhere.hgt", bytes.clone()).unwrap().notes()[0].contains("no georeference"));
    assert!(refused("N34W119.hgt", bytes[..17].to_vec()).contains("17 bytes are not a square"));
}

#[test]
fn texts_are_read_by_rows() {
    let text = "NCOLS 3\nnrows 2\nXLLCENTER 100\nyllcenter 200\ncellsize 10\nNODATA_value -1\n1 2 3 4\n-1 6\n";
    let mut raster = open("a.asc", text.into()).unwrap();
    assert_eq!((raster.size(), raster.first(), raster.lattice()), ([3, 2], [100.0, 210.0], Some(1.0)));
    let mut row = [0.0; 3];
    raster.read(1..2, &mut row).unwrap();
    assert!(same(&row, &[4.0, f64::NAN, 6.0]));
    raster.read(0..1, &mut row).unwrap();
    assert_eq!(row, [1.0, 2.0, 3.0]);
    let corner = text.replace("CENTER", "CORNER").replace("yllcenter", "yllcorner");
    assert_eq!(open("a.asc", corner.into()).unwrap().first(), [105.0, 215.0]);
    for (from, to, says) in [
        ("-1 6\n", "-1\n", "line 9: the file ends in row 1 at column 2 of 3"),
        ("-1 6\n", "-1 6 7\n", "more than 3 x 2 heights"),
        ("1 2 3", "1 2,5 3", "decimals have a point"),
        ("NCOLS 3", "NCOLS 0", "line 1: ncols of 0"),
        ("cellsize 10", "cellsize 0", "samples are 0 apart"),
        ("cellsize 10", "cell 10", "\"cell\" is not a header name"),
    ] {
        let line = refused("a.asc", text.replace(from, to).into());
        assert!(line.contains(says), "{line}");
    }
}

#[test]
fn rasters_that_abut_are_one_ground() {
    let folder = folder("mosaic");
    let write = |name: &str, size: [usize; 2], corner: [f64; 2], heights: &[i16]| {
        let tiff = placed(Tiff::wholes(size, heights)).doubles(33922, &[0.0, 0.0, 0.0, corner[0], corner[1], 0.0]);
        std::fs::write(folder.join(name), tiff.bytes()).unwrap();
        folder.join(name)
    };
    let a = write("a.tif", [2, 2], [0.0, 60.0], &[1, 2, 3, 4]);
    let b = write("b.tif", [1, 2], [60.0, 60.0], &[5, 6]);
    // Has its first row in common with a's last.
    let c = write("c.tif", [2, 2], [0.0, 30.0], &[3, 4, 7, 8]);
    let open = |paths: &[&PathBuf]| Raster::open(&paths.iter().map(|p| (*p).clone()).collect::<Vec<_>>(), &PLAIN);
    for order in [[&a, &b, &c], [&c, &b, &a]] {
        let mut raster = open(&order).unwrap();
        assert_eq!((raster.size(), raster.first()), ([3, 3], [15.0, 45.0]));
        assert!(same(&all(&mut raster), &[1.0, 2.0, 5.0, 3.0, 4.0, 6.0, 7.0, 8.0, f64::NAN]));
        assert!(raster.notes()[0].contains("1 samples"), "{:?}", raster.notes());
    }
    let far = write("far.tif", [2, 2], [150.0, 60.0], &[0; 4]);
    let off = write("off.tif", [2, 2], [69.0, 60.0], &[0; 4]);
    let over = write("over.tif", [3, 3], [0.0, 60.0], &[0; 9]);
    for (other, says) in
        [(&far, "3 samples away"), (&off, "0.300 of a sample to the east"), (&over, "it covers 2 x 2 samples")]
    {
        let line = open(&[&a, other]).unwrap_err().to_string();
        let named = [&a, other].iter().all(|p| line.contains(p.to_str().unwrap()));
        assert!(*other == over || line.ends_with("a.tif; give rasters of one lattice that abut"), "{line}");
        assert!(named && line.contains(says) && !line.contains('\n'), "{line}");
    }
    assert!(open(&[]).is_err());
}

/// Sizes, voids and ranges as `terrain/README.md` tells them.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn real_rasters_are_as_they_are_described() {
    let data = data();
    for (name, size, voids, range) in [
        ("terrain/exploradores_aster_30m.tif", [539, 618], 8908, None),
        ("terrain/bigtujunga.tif", [1197, 643], 0, Some([315.0, 2295.0])),
        ("terrain/dtm_2m.tif", [283, 259], 276, None),
        ("terrain/srtm_ref.tif", [1000, 1000], 0, Some([1111.0, 3270.0])),
        ("terrain/ky4_elevation.tif", [587, 402], 0, Some([117.0, 226.0])),
        ("dem-gpl/dem.tif", [367, 359], 0, None),
    ] {
        let mut raster = Raster::open(&[data.join(name)], &PLAIN).unwrap();
        let heights = all(&mut raster);
        let ends = heights.iter().fold([f64::MAX, f64::MIN], |[a, b], h| [a.min(*h), b.max(*h)]);
        let found = heights.iter().filter(|h| h.is_nan()).count();
        assert_eq!((raster.size(), found), (size, voids), "{name}");
        if let Some(range) = range {
            assert!((0..2).all(|i| (ends[i] - range[i]).abs() < 1.0), "{name}: {ends:?}");
        }
        let mut row = vec![0.0; size[0] as usize];
        for y in (0..size[1]).step_by(97) {
            raster.read(y..y + 1, &mut row).unwrap();
            assert!(same(&row, &heights[(y * size[0]) as usize..][..size[0] as usize]), "{name} {y}");
        }
    }
    let of = |name: &str| Raster::open(&[data.join("terrain").join(name)], &PLAIN).unwrap();
    // 90.975 US survey feet.
    let feet = of("ky4_elevation.tif");
    assert!(
        (feet.spacing()[0] - 27.729_296).abs() < 1e-5 && feet.notes().iter().any(|n| n.contains("heights count as metres"))
    );
    assert_eq!(of("bigtujunga.tif").first()[0], 376_313.655_454_263_5 + 15.0);
}

/// One hash for every machine, however many threads work.
#[test]
fn a_ground_has_the_same_bytes_on_every_machine() {
    let folder = folder("ground");
    let bytes = |threads: usize, name: &str, size: u32| {
        let path = folder.join(name);
        let made = bakes::on(threads, || ground(size, 30.0, 7, &path)).unwrap();
        (made, std::fs::read(path).unwrap())
    };
    let (made, small) = bytes(2, "a.tif", 129);
    assert_eq!(xxhash_rust::xxh3::xxh3_64(&small), 2_820_866_564_041_072_387);
    assert!(bytes(1, "b.tif", 4097).1 == bytes(2, "c.tif", 4097).1);
    let mut raster = Raster::open(&[folder.join("a.tif")], &PLAIN).unwrap();
    let heights = all(&mut raster);
    let ends = heights.iter().fold([f64::MAX, f64::MIN], |[a, b], h| [a.min(*h), b.max(*h)]);
    assert!((0..2).all(|i| (ends[i] - made.heights[i]).abs() < 1e-9) && ends[0] < ends[1]);
    assert_eq!(
        (raster.size(), raster.spacing(), raster.lattice(), raster.notes()),
        ([129; 2], [30.0; 2], Some(0.1), &[][..])
    );
    for (size, spacing) in [(64, 30.0), (40_000, 30.0), (129, 0.0), (129, f64::NAN)] {
        assert!(ground(size, spacing, 0, &folder.join("none.tif")).is_err() && !folder.join("none.tif").exists());
    }
}
