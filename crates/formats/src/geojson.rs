//! GeoJSON (RFC 7946): lines with a radius become tubes, such as mains, wells and risers of a geographic system.
//!
//! Coordinates are metres in a projected system: east, north, up. `(x, y, z)` becomes `(x, z, -y)`.

use super::lines::{Line, Lines};
use enfilade::scene::builder::short_name;
use enfilade::scene::{ImportError, ImportOptions, Place, Role, Scene, SceneBuilder, Source, whole_file};
use enfilade::types::note::Note;
use enfilade_tubes::Shape;
use glam::DVec3;
use serde_json::{Map, Value};
use std::path::Path;

/// Greatest longitude and latitude.
const DEGREES: [f64; 2] = [180.0, 90.0];

/// Reads a file's lines.
///
/// # Errors
///
/// If the file cannot be read, is not GeoJSON, has no lines, has a line without a radius, or has coordinates in degrees.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    from_slice(&whole_file::model(path)?, &name, options)
}

/// The same for a file in memory.
pub fn from_slice(bytes: &[u8], name: &str, options: &ImportOptions) -> Result<Scene, ImportError> {
    let whole: Value = serde_json::from_slice(bytes).map_err(|e| {
        let what = if bytes.is_empty() { "the file is empty".to_owned() } else { e.to_string() };
        ImportError::malformed(Place::Line(e.line().max(1)), what)
    })?;
    let scale = options.metres_per_unit.unwrap_or(1.0);
    let mut reader = Reader { scale, radius: options.tube_radius, lines: Vec::new(), others: 0 };
    reader.object(&whole, "", None)?;
    let Reader { lines, others, .. } = reader;
    if lines.is_empty() {
        return Err(ImportError::malformed(Place::File, "no lines: only LineString and MultiLineString make tubes"));
    }
    let has_system = whole.get("crs").is_some_and(|crs| !crs.is_null());
    let in_degrees = |p: &DVec3| p.x.abs() <= scale * DEGREES[0] && p.z.abs() <= scale * DEGREES[1];
    if !has_system && lines.iter().flat_map(|line| &line.points).all(in_degrees) {
        return Err(ImportError::Unsupported {
            what: "a file with coordinates in degrees".into(),
            hint: "project it to metres, or name its projected system in a member \"crs\"",
        });
    }
    let source = Source { format: "GeoJSON".into(), metres_per_unit: scale, up: "+Z".into(), notes: Vec::new() };
    let mut builder = SceneBuilder::new(options, source);
    let mut made = Lines::default();
    for NamedLine { place, name, points, radius } in &lines {
        let shape = Shape { radius: *radius, inner: 0.0, capped: true };
        let line = Line { name, place, role: Role::Furnishing, points, closed: false, smooth: false, shape };
        made.add(&mut builder, &line)?;
    }
    made.finish(&mut builder)?;
    if others > 0 {
        builder.source.notes.push(Note::fault(format!("{others} features left out: only lines become tubes")));
    }
    builder.finish(name)
}

/// A line with its radius.
struct NamedLine {
    /// Its place in the file.
    place: String,
    name: String,
    points: Vec<DVec3>,
    radius: f64,
}

/// Collects lines.
struct Reader {
    /// Metres per unit.
    scale: f64,
    /// Radius of lines without one, metres.
    radius: Option<f64>,
    lines: Vec<NamedLine>,
    /// Number of other geometries.
    others: u64,
}

/// Properties of the feature around a line.
struct Feature<'f> {
    properties: Option<&'f Map<String, Value>>,
    name: String,
}

impl Reader {
    /// Reads an object at a place in the file.
    fn object(&mut self, value: &Value, place: &str, feature: Option<&Feature<'_>>) -> Result<(), ImportError> {
        let member = |name: &str| format!("{place}{}{name}", if place.is_empty() { "" } else { "." });
        let malformed = |what: String| Err(ImportError::malformed(Place::File, what));
        let Some(kind) = value.get("type").and_then(Value::as_str) else {
            return malformed(format!("{}: not a type of GeoJSON", member("type")));
        };
        let all = |name: &str| value.get(name).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        match kind {
            "FeatureCollection" | "GeometryCollection" => {
                let name = if kind == "FeatureCollection" { "features" } else { "geometries" };
                let mut parts = all(name).iter().enumerate();
                parts.try_for_each(|(k, part)| self.object(part, &format!("{}[{k}]", member(name)), feature))
            }
            "Feature" => match value.get("geometry") {
                Some(geometry) if !geometry.is_null() => {
                    let properties = value.get("properties").and_then(Value::as_object);
                    let name = name_of(value, properties).unwrap_or_else(|| place.to_owned());
                    self.object(geometry, &member("geometry"), Some(&Feature { properties, name }))
                }
                _ => Ok(()),
            },
            "LineString" => self.line(all("coordinates"), &member("coordinates"), feature),
            "MultiLineString" => {
                let mut lines = all("coordinates").iter().enumerate();
                lines.try_for_each(|(k, line)| {
                    let line = line.as_array().map_or(&[][..], Vec::as_slice);
                    self.line(line, &format!("{}[{k}]", member("coordinates")), feature)
                })
            }
            "Point" | "MultiPoint" | "Polygon" | "MultiPolygon" => {
                self.others += 1;
                Ok(())
            }
            _ => malformed(format!("{}: not a type of GeoJSON", member("type"))),
        }
    }

    fn line(&mut self, positions: &[Value], place: &str, feature: Option<&Feature<'_>>) -> Result<(), ImportError> {
        let malformed = |what: String| ImportError::malformed(Place::File, what);
        let points = positions.iter().enumerate().map(|(k, position)| {
            let at = |i: usize| position.get(i).and_then(Value::as_f64);
            let up = position.get(2).map_or(Some(0.0), Value::as_f64);
            let point = at(0).zip(at(1)).zip(up).map(|((x, y), z)| DVec3::new(x, z, 0.0 - y) * self.scale);
            point.ok_or_else(|| malformed(format!("{place}[{k}]: not a position: two or three numbers")))
        });
        let points = points.collect::<Result<Vec<_>, _>>()?;
        let number = |name: &str| feature.and_then(|f| f.properties?.get(name)).and_then(Value::as_f64);
        let own = number("radius").or_else(|| number("diameter").map(|d| d / 2.0)).map(|radius| radius * self.scale);
        let radius = own.or(self.radius).ok_or_else(|| {
            malformed(format!(
                "{place}: no radius; give the feature a property \"radius\" or \"diameter\", in the file's unit of length, or give all lines \
                 --tubes METRES"
            ))
        })?;
        let name = short_name(feature.map_or(place, |feature| &feature.name));
        self.lines.push(NamedLine { place: place.to_owned(), name, points, radius });
        Ok(())
    }
}

/// The name of a feature: its id, or a property `name` or `id`.
fn name_of(feature: &Value, properties: Option<&Map<String, Value>>) -> Option<String> {
    let text = |value: &Value| match value {
        Value::String(text) if !text.is_empty() => Some(text.clone()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    };
    let named = |name: &str| properties.and_then(|properties| properties.get(name));
    [feature.get("id"), named("name"), named("id")].into_iter().flatten().find_map(text)
}
