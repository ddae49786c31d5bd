//! The file as records: checks the header, indexes records by kind, reads units and the offset of georeferenced models.

use enfilade::scene::{ImportError, Place, whole_file};
use enfilade::types::note::Note;
use glam::DVec3;
use ifc_lite_core::{
    DecodedEntity, EntityDecoder, EntityIndex, EntityScanner, IfcType, build_entity_index, geometry_flags_by_name,
    ifc_type_from_keyword, nth_attribute_is_present, set_report_sink,
};
use ifc_lite_geometry::{GeometryRouter, void_index_from_content};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// The hasher of ifc-lite's maps, which it doesn't re-export.
pub(super) trait MapHasher {
    /// The hasher.
    type Hasher;
}
impl<K, V, S> MapHasher for HashMap<K, V, S> {
    type Hasher = S;
}

/// Openings by host element.
pub(super) type Voids = HashMap<u32, Vec<u32>, <EntityIndex as MapHasher>::Hasher>;

/// A product: an entity with a place in the building.
#[derive(Clone, Debug)]
pub(super) struct Product {
    /// Its record.
    pub(super) id: u32,
    /// Its class.
    pub(super) kind: IfcType,
    /// Whether it has a representation.
    pub(super) shaped: bool,
}

/// A file in memory with its index.
pub(super) struct Model {
    bytes: Vec<u8>,
    index: Arc<EntityIndex>,
    /// `IFC2X3`, `IFC4`, ... as declared.
    pub(super) schema: String,
    /// Metres per unit of length.
    pub(super) metres: f64,
    radians: f64,
    /// Subtracted by ifc-lite before it rounds to `f32`; metres, +Z up.
    pub(super) offset: DVec3,
    /// Openings by host, also for the parts of hosts.
    pub(super) voids: Voids,
    /// In file order.
    pub(super) products: Vec<Product>,
    others: HashMap<&'static str, Vec<u32>>,
    /// Irregularities found.
    pub(super) notes: Vec<Note>,
}

/// Record kinds indexed besides products, by keyword.
const KINDS: [&str; 12] = [
    "IFCRELVOIDSELEMENT",
    "IFCRELFILLSELEMENT",
    "IFCRELAGGREGATES",
    "IFCRELCONTAINEDINSPATIALSTRUCTURE",
    "IFCRELSPACEBOUNDARY",
    "IFCRELSPACEBOUNDARY1STLEVEL",
    "IFCRELSPACEBOUNDARY2NDLEVEL",
    "IFCRELDEFINESBYTYPE",
    "IFCRELASSOCIATESMATERIAL",
    "IFCSTYLEDITEM",
    "IFCMATERIALDEFINITIONREPRESENTATION",
    "IFCPROJECT",
];

impl Model {
    /// Reads the records of a file. `metres` overrides the file's unit of length.
    pub(super) fn read(mut bytes: Vec<u8>, metres: Option<f64>) -> Result<Self, ImportError> {
        let notes = settle_envelope(&mut bytes)?.into_iter().map(Note::detail).collect();
        spell(&mut bytes);
        let bytes = with_shapes(bytes);
        // The notes below replace the messages of ifc-lite on stderr.
        set_report_sink(|_| ());
        let index = Arc::new(build_entity_index(&bytes));
        let schema = ifc_lite_core::declared_schema_bounded(&bytes).map(|s| s.to_ascii_uppercase());
        let is_word = |s: &String| s.len() < 32 && s.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
        let schema = schema.filter(is_word).unwrap_or_else(|| "IFC".into());
        let mut model = Self {
            bytes,
            index,
            schema,
            metres: 1.0,
            radians: 1.0,
            offset: DVec3::ZERO,
            voids: Voids::default(),
            products: Vec::new(),
            others: HashMap::new(),
            notes,
        };
        model.scan()?;
        model.settle_units(metres)?;
        let mut decoder = model.decoder();
        let voids = void_index_from_content(&model.bytes, &mut decoder);
        let (x, y, z) = model
            .router()
            .detect_rtc_offset_for_file(&model.bytes, &mut decoder)
            .map_or((0.0, 0.0, 0.0), ifc_lite_core::RtcVerdict::offset);
        drop(decoder);
        model.voids = voids;
        model.offset = Some(DVec3::new(x, y, z)).filter(|o| o.is_finite()).unwrap_or(DVec3::ZERO);
        Ok(model)
    }

    /// A decoder of these records, for one thread.
    pub(super) fn decoder(&self) -> EntityDecoder<'_> {
        let mut decoder = EntityDecoder::with_arc_index(&self.bytes, self.index.clone()).with_strict_reals();
        decoder.seed_unit_scales(self.metres, self.radians);
        decoder
    }

    /// A geometry router for these records, for one thread.
    pub(super) fn router(&self) -> GeometryRouter {
        let mut router = GeometryRouter::with_scale(self.metres);
        router.enable_content_dedup_shared(GeometryRouter::new_dedup_cache());
        router.set_rtc_offset(self.offset.into());
        router
    }

    /// The records of a kind, in file order.
    pub(super) fn records(&self, kind: &'static str) -> &[u32] {
        debug_assert!(KINDS.contains(&kind));
        self.others.get(kind).map_or(&[], Vec::as_slice)
    }

    /// Scans the file once and sorts its records by kind.
    fn scan(&mut self) -> Result<(), ImportError> {
        let mut twice = 0;
        let mut scanner = EntityScanner::new(&self.bytes);
        while let Some((id, keyword, start, end)) = scanner.next_entity() {
            // The last record of a number counts, as for references; a repeated DATA section adds nothing.
            if self.index.get(&id) != Some(&(start, end)) {
                twice += 1;
                continue;
            }
            let (geometry, spatial) = geometry_flags_by_name(keyword);
            if geometry || spatial {
                let shaped = nth_attribute_is_present(&self.bytes[start..end], 6);
                self.products.push(Product { id, kind: ifc_type_from_keyword(keyword), shaped });
            } else if let Some(kind) = KINDS.iter().find(|k| k.eq_ignore_ascii_case(keyword)) {
                self.others.entry(kind).or_default().push(id);
            }
        }
        let broken = scanner.malformed_record_starts();
        if let Some(&first) = broken.first() {
            let line = line_of(&self.bytes, first);
            let what = format!("line {line}: skipped an unreadable record ({} in all)", broken.len());
            self.notes.push(Note::fault(what));
        }
        if scanner.skipped_oversized_ids() > 0 {
            let what = format!("{} records skipped: their numbers exceed 32 bits", scanner.skipped_oversized_ids());
            self.notes.push(Note::fault(what));
        }
        if twice > 0 {
            self.notes.push(Note::detail(format!("{twice} records occur more than once; the last one counts")));
        }
        if self.index.is_empty() {
            return Err(ImportError::malformed(self.data_place(), "no records in the DATA section"));
        }
        if self.records("IFCPROJECT").is_empty() {
            if self.products.is_empty() {
                let what = "no IFCPROJECT and no product in the DATA section: not a building model";
                return Err(ImportError::malformed(self.data_place(), what));
            }
            let what = "no IFCPROJECT, so units are unknown: the file is part of a model; give metres per unit with --unit";
            self.notes.push(Note::fault(what));
        }
        Ok(())
    }

    fn data_place(&self) -> Place {
        Place::Line(find(&self.bytes, b"DATA;").map_or(1, |at| line_of(&self.bytes, at)))
    }

    /// Units of length and angle. ifc-lite assumes radians without a unit; exporters that omit it mean degrees.
    fn settle_units(&mut self, metres: Option<f64>) -> Result<(), ImportError> {
        let project = self.records("IFCPROJECT").first().copied();
        let mut decoder = EntityDecoder::with_arc_index(&self.bytes, self.index.clone());
        let units = project
            .and_then(|project| decoder.decode_by_id(project).ok())
            .and_then(|p| p.get_ref(8))
            .and_then(|id| decoder.decode_by_id(id).ok())
            .and_then(|a| a.get_refs(0))
            .unwrap_or_default();
        let declared = |decoder: &mut EntityDecoder<'_>, unit_type: &str| {
            units.iter().any(|&u| decoder.decode_by_id(u).is_ok_and(|u| enumeration(&u, 1) == Some(unit_type)))
        };
        let length = declared(&mut decoder, "LENGTHUNIT")
            .then(|| ifc_lite_core::extract_length_unit_scale(&mut decoder, project?).ok())
            .flatten();
        let angle = declared(&mut decoder, "PLANEANGLEUNIT")
            .then(|| ifc_lite_core::try_extract_plane_angle_to_radians(&mut decoder, project?))
            .flatten();
        drop(decoder);
        let usable = |scale: &f64| scale.is_finite() && *scale > 0.0;
        self.metres = match (metres, length.filter(usable)) {
            (Some(m), _) if !usable(&m) => {
                return Err(ImportError::malformed(Place::File, "metres per unit must be a finite number above 0"));
            }
            (Some(m), _) | (None, Some(m)) => m,
            (None, None) => {
                self.notes.push(Note::taken("no unit of length is given; metres are assumed"));
                1.0
            }
        };
        self.radians = angle.filter(usable).unwrap_or_else(|| {
            self.notes.push(Note::detail("no unit of angle is given; degrees are assumed"));
            PI / 180.0
        });
        Ok(())
    }
}

/// Names unknown to ifc-lite, with known names of the same length: a shape type of old exporters, which is ignored otherwise, and
/// a pipe along a polyline, which has the attributes of a pipe and then the radius of its bends.
const SPELLINGS: [(&[u8], &[u8]); 2] =
    [(b"'FacetedBrep'", b"'Brep'       "), (b"IFCSWEPTDISKSOLIDPOLYGONAL(", b"IFCSWEPTDISKSOLID(         ")];

/// Replaces names that ifc-lite does not know.
fn spell(bytes: &mut [u8]) {
    for (old, new) in SPELLINGS {
        let mut from = 0;
        while let Some(at) = find(&bytes[from..], old) {
            bytes[from + at..][..old.len()].copy_from_slice(new);
            from += at + old.len();
        }
    }
}

/// IFC 2x3 allows an IfcProductRepresentation, which ifc-lite refuses. It becomes an IfcProductDefinitionShape, which has the
/// same attributes.
fn with_shapes(bytes: Vec<u8>) -> Vec<u8> {
    const OLD: &[u8] = b"IFCPRODUCTREPRESENTATION";
    const NEW: &[u8] = b"IFCPRODUCTDEFINITIONSHAPE";
    let (mut found, mut copied) = (Vec::new(), 0);
    for (at, _) in bytes.iter().enumerate().filter(|(_, b)| **b == b'=') {
        let keyword = at + 1 + bytes[at + 1..].iter().take_while(|b| b.is_ascii_whitespace()).count();
        let Some(end) = keyword.checked_add(OLD.len()).filter(|&end| end < bytes.len()) else { break };
        if bytes[keyword..end].eq_ignore_ascii_case(OLD) && matches!(bytes[end], b'(' | b' ' | b'\t' | b'\r' | b'\n') {
            found.extend_from_slice(&bytes[copied..keyword]);
            found.extend_from_slice(NEW);
            copied = end;
        }
    }
    if copied == 0 {
        return bytes;
    }
    found.extend_from_slice(&bytes[copied..]);
    found
}

/// Start of a STEP file.
const HEADER: &[u8] = b"ISO-10303-21";
/// Maximum bytes skipped before the header. Less: a comment of a few lines hides a model. More: a text about STEP files counts as
/// one.
const MOST_BEFORE: usize = 1024;

/// Checks that a file begins with `ISO-10303-21` and ends with `END-ISO-10303-21`. Blanks replace a few bytes before the
/// beginning, which keeps line numbers; returns a note unless they are a comment.
pub(super) fn settle_envelope(bytes: &mut [u8]) -> Result<Option<String>, ImportError> {
    let broken = |what: String| ImportError::malformed(Place::File, what);
    let text = whole_file::text_of(bytes);
    if text.is_empty() {
        return Err(broken("the file is empty".into()));
    }
    let Some(start) = find(&bytes[..bytes.len().min(MOST_BEFORE + HEADER.len())], HEADER) else {
        if text.starts_with(b"PK") {
            return Err(ImportError::Unsupported { what: "zipped IFC".into(), hint: "unzip it and give the .ifc inside" });
        }
        if text.starts_with(b"<") {
            return Err(ImportError::Unsupported { what: "IFC as XML".into(), hint: "export it as a STEP file (.ifc)" });
        }
        let what = whole_file::nature(bytes);
        return Err(broken(format!("not an IFC file: no ISO-10303-21 at its beginning; {what}")));
    };
    let note = (!is_comment(&bytes[..start])).then(|| {
        let before = whole_file::text_of(&bytes[..start]).trim_ascii_end();
        format!("{} bytes before ISO-10303-21 are ignored; {}", before.len(), whole_file::nature(before))
    });
    bytes[..start].iter_mut().filter(|b| **b != b'\n').for_each(|b| *b = b' ');
    // Comments or a signature may follow the end.
    let tail = &bytes[bytes.len().saturating_sub(64 << 10)..];
    if !tail.windows(16).any(|w| w.eq_ignore_ascii_case(b"END-ISO-10303-21")) {
        let place = Place::Line(line_of(bytes, bytes.len()));
        return Err(ImportError::malformed(
            place,
            "the file ends before END-ISO-10303-21: it is truncated; download it again",
        ));
    }
    Ok(note)
}

/// Whether a text consists of blanks and comments.
fn is_comment(text: &[u8]) -> bool {
    let mut rest = whole_file::text_of(text);
    while let Some(comment) = rest.strip_prefix(b"/*") {
        let Some(end) = find(comment, b"*/") else { return false };
        rest = comment[end + 2..].trim_ascii_start();
    }
    rest.is_empty()
}

fn line_of(bytes: &[u8], at: usize) -> usize {
    1 + bytes[..at].iter().filter(|&&b| b == b'\n').count()
}

fn find(bytes: &[u8], what: &[u8]) -> Option<usize> {
    bytes.windows(what.len()).position(|w| w == what)
}

/// An enumeration's value, without its dots.
pub(super) fn enumeration(entity: &DecodedEntity, slot: usize) -> Option<&str> {
    entity.get(slot)?.as_enum()
}

/// A string that is not blank.
pub(super) fn text(entity: &DecodedEntity, slot: usize) -> Option<&str> {
    entity.get_string(slot).map(str::trim).filter(|s| !s.is_empty())
}

/// The GlobalId, or the record's number if it has none.
pub(super) fn global_id(entity: &DecodedEntity) -> String {
    text(entity, 0).map_or_else(|| format!("#{}", entity.id), str::to_owned)
}

/// From +Z up to +Y up.
pub(super) fn y_up(p: DVec3) -> DVec3 {
    // 0 - y, because -y would turn 0 into -0.
    DVec3::new(p.x, p.z, 0.0 - p.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_and_cut_files_are_told_apart() {
        let message = |bytes: &[u8]| settle_envelope(&mut bytes.to_vec()).unwrap_err().to_string();
        assert_eq!(message(b" \n"), "the file is empty");
        assert!(message(b"PK\x03\x04").starts_with("zipped IFC is not supported"));
        assert!(message(b"<?xml").starts_with("IFC as XML is not supported"));
        assert!(message(b"solid cube").starts_with("not an IFC file: no ISO-10303-21 at its beginning; it is STL"));
        assert!(message(b"The model is elsewhere").ends_with("it begins with the text `The model is elsewhere`"));
        assert!(message(b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=IFC").starts_with("line 5: the file ends before"));
        let far = [" /* */".repeat(MOST_BEFORE).as_bytes(), b"ISO-10303-21;\nEND-ISO-10303-21;"].concat();
        assert!(message(&far).starts_with("not an IFC file"));
    }

    #[test]
    fn a_product_representation_is_a_shape() {
        let with = |text: &str| String::from_utf8(with_shapes(text.as_bytes().to_vec())).unwrap();
        assert_eq!(
            with("#1=IFCPRODUCTREPRESENTATION($,$,(#2));\n#3 = IfcProductRepresentation\n($,$,());\n"),
            "#1=IFCPRODUCTDEFINITIONSHAPE($,$,(#2));\n#3 = IFCPRODUCTDEFINITIONSHAPE\n($,$,());\n"
        );
        for same in [
            "#1=IFCPRODUCTREPRESENTATIONS($);",
            "#1=IFCWALL('IFCPRODUCTREPRESENTATION(');",
            "=",
            "#1=IFCPRODUCTREPRESENTATION",
        ] {
            assert_eq!(with(same), same);
        }
    }

    #[test]
    fn what_precedes_the_header_is_ignored() {
        let rest = "ISO-10303-21;\nEND-ISO-10303-21;\n/* bye */";
        for (before, note) in [
            ("", None),
            ("\u{feff}", None),
            ("\u{feff}\n\t \r\n", None),
            ("/* by hand #1=IFCWALL(); */\n/**/ ", None),
            ("`", Some("1 bytes before ISO-10303-21 are ignored; it begins with the text ```")),
            ("\nstep:\n", Some("5 bytes before ISO-10303-21 are ignored; it begins with the text `step:`")),
            ("/* open ", Some("7 bytes before ISO-10303-21 are ignored; it begins with the text `/* open`")),
        ] {
            let mut bytes = [before, rest].concat().into_bytes();
            assert_eq!(settle_envelope(&mut bytes).unwrap().as_deref(), note, "{before:?}");
            let blanks: Vec<u8> = before.bytes().map(|b| if b == b'\n' { b } else { b' ' }).collect();
            assert_eq!(bytes, [&blanks, rest.as_bytes()].concat(), "{before:?}");
        }
    }
}
