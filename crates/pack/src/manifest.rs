//! The manifest of a packed folder: what its files hold. docs/format.md describes it.

use crate::folder::Packed;
use crate::gzip::gzip;
use glam::DVec3;
use serde_json::{Map, Value, json};
use std::collections::HashSet;
use std::ops::Range;

/// Version of the folder.
pub const VERSION: u64 = 2;
/// Name of the manifest.
pub const MANIFEST: &str = "manifest.jsonz";

/// The files of a packed folder.
#[derive(Clone, PartialEq, Debug)]
pub struct Manifest {
    /// The `.pvs` file.
    pub pvs: FileEntry,
    /// [`PvsFile::model_hash`](enfilade::file::PvsFile::model_hash).
    pub model: u128,
    /// Added to positions to get the model's own coordinates, metres.
    pub origin: DVec3,
    /// Number of objects.
    pub objects: u32,
    /// Files of objects. Each object is in one.
    pub chunks: Vec<Chunk>,
    /// Files of meshes that several objects share. Their meshes are numbered through.
    pub meshes: Vec<MeshFile>,
    /// Pictures.
    pub pictures: Vec<FileEntry>,
    /// A page that walks in the folder.
    pub page: Vec<FileEntry>,
}

/// A file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FileEntry {
    /// Name below the folder, with `/` between parts.
    pub file: String,
    /// Size.
    pub bytes: u64,
    /// XXH3-64 of its bytes.
    pub hash: u64,
}

/// A file of objects.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Chunk {
    /// The file.
    pub file: FileEntry,
    /// Ids of its objects, ascending.
    pub objects: Vec<Range<u32>>,
    /// Indices of the files with the meshes of its objects, ascending.
    pub meshes: Vec<u32>,
    /// Indices of its pictures, without those of the files of meshes, ascending.
    pub pictures: Vec<u32>,
}

/// A file of shared meshes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MeshFile {
    /// The file.
    pub file: FileEntry,
    /// Numbers of its meshes.
    pub meshes: Range<u32>,
    /// Indices of its pictures, ascending.
    pub pictures: Vec<u32>,
}

/// Why a manifest is refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ManifestError {
    /// Not JSON.
    #[error("not a manifest: {0}")]
    Json(#[from] serde_json::Error),
    /// A field is missing or has a wrong value.
    #[error("{field}: {what}")]
    Field {
        /// The field, such as `chunks[3].bytes`.
        field: String,
        /// What it has to be.
        what: &'static str,
    },
}

impl FileEntry {
    /// The entry of a file with these bytes.
    pub fn of(file: impl Into<String>, bytes: &[u8]) -> Self {
        Self { file: file.into(), bytes: bytes.len() as u64, hash: xxhash_rust::xxh3::xxh3_64(bytes) }
    }

    fn json(&self) -> Value {
        json!({ "file": self.file, "bytes": self.bytes, "hash": format!("{:016x}", self.hash) })
    }
}

impl Manifest {
    /// All files but the manifest.
    pub fn files(&self) -> impl Iterator<Item = &FileEntry> {
        let chunks = self.chunks.iter().map(|chunk| &chunk.file);
        let meshes = self.meshes.iter().map(|file| &file.file);
        std::iter::once(&self.pvs).chain(chunks).chain(meshes).chain(&self.pictures).chain(&self.page)
    }

    /// For each object the index of its chunk.
    pub fn chunk_of_object(&self) -> Vec<u32> {
        let mut chunks = vec![0; self.objects as usize];
        for (number, chunk) in self.chunks.iter().enumerate() {
            chunk.objects.iter().cloned().flatten().for_each(|object| chunks[object as usize] = number as u32);
        }
        chunks
    }

    /// The file.
    pub(crate) fn packed(&self) -> Packed {
        Packed { name: MANIFEST.to_owned(), bytes: gzip(self.write().as_bytes()) }
    }

    /// The text of the file.
    pub fn write(&self) -> String {
        let with = |entry: &FileEntry, lists: &[(&str, Vec<u32>)]| {
            let mut value = entry.json();
            lists.iter().filter(|(_, list)| !list.is_empty()).for_each(|(name, list)| value[name] = json!(list));
            value
        };
        let ends = |range: &Range<u32>| [range.start, range.end];
        let chunk = |c: &Chunk| {
            let objects = c.objects.iter().flat_map(ends).collect();
            with(&c.file, &[("objects", objects), ("meshes", c.meshes.clone()), ("pictures", c.pictures.clone())])
        };
        let meshes = |m: &MeshFile| with(&m.file, &[("meshes", ends(&m.meshes).to_vec()), ("pictures", m.pictures.clone())]);
        let entries = |list: &[FileEntry]| list.iter().map(FileEntry::json).collect::<Vec<_>>();
        let mut root = json!({
            "enfilade": VERSION,
            "pvs": self.pvs.json(),
            "model": format!("{:032x}", self.model),
            "origin": self.origin.to_array(),
            "objects": self.objects,
            "chunks": self.chunks.iter().map(chunk).collect::<Vec<_>>(),
            "meshes": self.meshes.iter().map(meshes).collect::<Vec<_>>(),
            "pictures": entries(&self.pictures),
        });
        if !self.page.is_empty() {
            root["page"] = json!(entries(&self.page));
        }
        root.to_string()
    }

    /// Reads and checks the text of a manifest: names stay within the folder, indices and ranges within their lists, and each object is in one
    /// chunk.
    ///
    /// # Errors
    ///
    /// Names the first field that is not so.
    pub fn read(text: &str) -> Result<Self, ManifestError> {
        let root: Value = serde_json::from_str(text)?;
        let root =
            Fields { at: String::new(), map: root.as_object().ok_or_else(|| fault("manifest", "must be an object"))? };
        if root.whole("enfilade", u64::MAX)? != VERSION {
            return Err(fault("enfilade", "must be 2, the version of the folder"));
        }
        let origin = root.list("origin")?.iter().map(|x| x.as_f64().filter(|x| x.is_finite())).collect::<Option<Vec<f64>>>();
        let origin = origin.and_then(|origin| <[f64; 3]>::try_from(origin).ok());
        let manifest = Self {
            pvs: root.within("pvs")?.file()?,
            model: u128::from_str_radix(root.hex("model", 32)?, 16).unwrap_or_default(),
            origin: origin.map(DVec3::from_array).ok_or_else(|| fault("origin", "must be three numbers"))?,
            objects: root.whole("objects", u64::from(u32::MAX))? as u32,
            pictures: root.entries("pictures", Fields::file)?,
            meshes: root.entries("meshes", Fields::mesh_file)?,
            chunks: root.entries("chunks", Fields::chunk)?,
            page: if root.map.contains_key("page") { root.entries("page", Fields::file)? } else { Vec::new() },
        };
        manifest.check()?;
        Ok(manifest)
    }

    fn check(&self) -> Result<(), ManifestError> {
        let mut names = HashSet::from([MANIFEST]);
        if let Some(twice) = self.files().find(|entry| !names.insert(&entry.file)) {
            return Err(fault(&twice.file, "is the name of two files"));
        }
        let within = |list: &[u32], count: usize, field: String| match list.last() {
            Some(&last) if last as usize >= count => Err(fault(&field, "must be indices of the manifest's list")),
            _ => Ok(()),
        };
        let mut next = 0;
        for (i, file) in self.meshes.iter().enumerate() {
            within(&file.pictures, self.pictures.len(), format!("meshes[{i}].pictures"))?;
            if file.meshes.start != next || file.meshes.is_empty() {
                return Err(fault(
                    &format!("meshes[{i}].meshes"),
                    "must begin where the file before ends, and have one mesh",
                ));
            }
            next = file.meshes.end;
        }
        // Ranges before a check of their sum may have 4 billion objects.
        let mut ranges: Vec<(&Range<u32>, usize)> = Vec::new();
        for (i, chunk) in self.chunks.iter().enumerate() {
            within(&chunk.meshes, self.meshes.len(), format!("chunks[{i}].meshes"))?;
            within(&chunk.pictures, self.pictures.len(), format!("chunks[{i}].pictures"))?;
            ranges.extend(chunk.objects.iter().map(|range| (range, i)));
        }
        ranges.sort_unstable_by_key(|(range, _)| range.start);
        let mut next = 0;
        for (range, i) in ranges {
            if range.start != next || range.end > self.objects {
                return Err(fault(
                    &format!("chunks[{i}].objects"),
                    "must have each object of the model once, with the other chunks",
                ));
            }
            next = range.end;
        }
        if next != self.objects {
            return Err(fault("chunks", "must have each object of the model"));
        }
        Ok(())
    }
}

fn fault(field: &str, what: &'static str) -> ManifestError {
    ManifestError::Field { field: field.to_owned(), what }
}

/// Whether a name leads to a file in the folder: plain words, with `/` between them.
pub(crate) fn is_within(name: &str) -> bool {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    name.len() < 256 && name.split('/').all(|part| !part.starts_with('.') && !part.is_empty() && part.chars().all(is_plain))
}

/// An object of the manifest, and its name.
struct Fields<'v> {
    at: String,
    map: &'v Map<String, Value>,
}

impl<'v> Fields<'v> {
    fn name(&self, key: &str) -> String {
        if self.at.is_empty() { key.to_owned() } else { format!("{}.{key}", self.at) }
    }

    fn fault(&self, key: &str, what: &'static str) -> ManifestError {
        fault(&self.name(key), what)
    }

    fn whole(&self, key: &str, most: u64) -> Result<u64, ManifestError> {
        let number = self.map.get(key).and_then(Value::as_u64).filter(|number| *number <= most);
        number.ok_or_else(|| self.fault(key, "must be a whole number within its limits"))
    }

    fn list(&self, key: &str) -> Result<&'v [Value], ManifestError> {
        self.map.get(key).and_then(Value::as_array).map(Vec::as_slice).ok_or_else(|| self.fault(key, "must be a list"))
    }

    fn within(&self, key: &str) -> Result<Fields<'v>, ManifestError> {
        let map = self.map.get(key).and_then(Value::as_object).ok_or_else(|| self.fault(key, "must be an object"))?;
        Ok(Fields { at: self.name(key), map })
    }

    fn hex(&self, key: &str, digits: usize) -> Result<&'v str, ManifestError> {
        let is_digit = |c: char| matches!(c, '0'..='9' | 'a'..='f');
        let text =
            self.map.get(key).and_then(Value::as_str).filter(|text| text.len() == digits && text.chars().all(is_digit));
        text.ok_or_else(|| self.fault(key, "must be a hash in lower-case hexadecimal digits"))
    }

    fn entries<T>(&self, key: &str, read: fn(&Fields<'v>) -> Result<T, ManifestError>) -> Result<Vec<T>, ManifestError> {
        let entry = |(i, value): (usize, &'v Value)| {
            let at = format!("{}[{i}]", self.name(key));
            let map = value.as_object().ok_or_else(|| fault(&at, "must be an object"))?;
            read(&Fields { at, map })
        };
        self.list(key)?.iter().enumerate().map(entry).collect()
    }

    /// A list of ascending whole numbers; none if it is not there.
    fn ascending(&self, key: &str) -> Result<Vec<u32>, ManifestError> {
        if !self.map.contains_key(key) {
            return Ok(Vec::new());
        }
        let numbers =
            self.list(key)?.iter().map(|n| n.as_u64().and_then(|n| u32::try_from(n).ok())).collect::<Option<Vec<_>>>();
        let numbers = numbers.filter(|numbers| numbers.is_sorted_by(|a, b| a < b));
        numbers.ok_or_else(|| self.fault(key, "must be ascending whole numbers"))
    }

    /// Ends of ranges: first, end, first, end.
    fn ranges(&self, key: &str) -> Result<Vec<Range<u32>>, ManifestError> {
        let ends = self.ascending(key)?;
        if ends.is_empty() || ends.len() % 2 != 0 {
            return Err(self.fault(key, "must be pairs: the first, and the end"));
        }
        Ok(ends.chunks_exact(2).map(|pair| pair[0]..pair[1]).collect())
    }

    fn file(&self) -> Result<FileEntry, ManifestError> {
        let file = self.map.get("file").and_then(Value::as_str).filter(|name| is_within(name));
        let file = file.ok_or_else(|| self.fault("file", "must be the name of a file in the folder"))?;
        // Numbers of JavaScript.
        let bytes = self.whole("bytes", 1 << 53)?;
        let hash = u64::from_str_radix(self.hex("hash", 16)?, 16).unwrap_or_default();
        Ok(FileEntry { file: file.to_owned(), bytes, hash })
    }

    fn mesh_file(&self) -> Result<MeshFile, ManifestError> {
        let ranges = self.ranges("meshes")?;
        let [meshes] = <[Range<u32>; 1]>::try_from(ranges).map_err(|_| self.fault("meshes", "must be one pair"))?;
        Ok(MeshFile { file: self.file()?, meshes, pictures: self.ascending("pictures")? })
    }

    fn chunk(&self) -> Result<Chunk, ManifestError> {
        let [meshes, pictures] = [self.ascending("meshes")?, self.ascending("pictures")?];
        Ok(Chunk { file: self.file()?, objects: self.ranges("objects")?, meshes, pictures })
    }
}
