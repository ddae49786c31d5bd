//! Names, types and properties of elements and spaces. [`crate::elements()`] reads them on demand; an import does not.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

/// The elements and spaces of a file.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Elements {
    /// In file order.
    pub all: Vec<Element>,
    /// Problems found, one line each.
    pub notes: Vec<String>,
    by_id: HashMap<String, usize>,
}

/// An element or a space.
#[derive(Clone, PartialEq, Debug)]
pub struct Element {
    /// Its GlobalId, or `#` and the record's number if it has none. It is the [`node`](enfilade::scene::Object::node) of its
    /// objects, and the `source` of a space's cell.
    pub global_id: String,
    /// `IfcWallStandardCase`, ...
    pub class: String,
    /// `Name`.
    pub name: Option<String>,
    /// `LongName` of a space.
    pub long_name: Option<String>,
    /// `Tag` of an element: its number in the authoring program.
    pub tag: Option<String>,
    /// `ObjectType`: a type as text.
    pub object_type: Option<String>,
    /// Its type (IfcRelDefinesByType).
    pub kind: Option<Arc<ElementType>>,
    /// Its own property sets and quantities, in file order.
    pub sets: Vec<Arc<PropertySet>>,
}

/// The type that several elements share.
#[derive(Clone, PartialEq, Debug)]
pub struct ElementType {
    /// Its GlobalId.
    pub global_id: String,
    /// `IfcDoorStyle`, ...
    pub class: String,
    /// `Name`.
    pub name: Option<String>,
    /// Its property sets, which also apply to its elements.
    pub sets: Vec<Arc<PropertySet>>,
}

/// An IfcPropertySet or IfcElementQuantity.
#[derive(Clone, PartialEq, Debug)]
pub struct PropertySet {
    /// `Pset_WallCommon`, `BaseQuantities`, ...
    pub name: String,
    /// Whether it holds quantities.
    pub is_quantities: bool,
    /// In the file's order.
    pub properties: Vec<Property>,
}

/// A property or a quantity.
#[derive(Clone, PartialEq, Debug)]
pub struct Property {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: Value,
}

/// A value, in the file's own units.
#[derive(Clone, PartialEq, Debug)]
pub enum Value {
    /// Text; lists are joined with commas. Also `true`, `false` or `unknown`.
    Text(String),
    /// A finite number, and the symbol of its unit if it has one: `m²`, `°`, ...
    Number(f64, Option<String>),
}

/// Decimals shown of a number: programs write 2.01 as 2.009999999999999.
const DECIMALS: usize = 6;
/// Smaller numbers would show as 0 with [`DECIMALS`]; larger ones have too many digits to read.
const PLAIN: (f64, f64) = (1e-6, 1e15);

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Number(number, unit) => {
                let size = number.abs();
                if size != 0.0 && (size < PLAIN.0 || size > PLAIN.1) {
                    write!(f, "{number:e}")?;
                } else {
                    let digits = format!("{number:.DECIMALS$}");
                    let digits = digits.trim_end_matches('0').trim_end_matches('.');
                    f.write_str(if digits == "-0" { "0" } else { digits })?;
                }
                unit.as_ref().map_or(Ok(()), |unit| write!(f, " {unit}"))
            }
        }
    }
}

impl Elements {
    /// From the elements that were read. If several have one GlobalId, the first is found by it.
    #[cfg(feature = "ifc")]
    pub(crate) fn new(all: Vec<Element>, notes: Vec<String>) -> Self {
        let mut by_id = HashMap::with_capacity(all.len());
        for (i, element) in all.iter().enumerate() {
            by_id.entry(element.global_id.clone()).or_insert(i);
        }
        Self { all, notes, by_id }
    }

    /// The element with a GlobalId: the `node` of an object, or the `source` of a space's cell.
    pub fn get(&self, global_id: &str) -> Option<&Element> {
        self.by_id.get(global_id).map(|&i| &self.all[i])
    }
}

impl Element {
    /// The name of its type; without a type, `ObjectType`.
    pub fn type_name(&self) -> Option<&str> {
        self.kind.as_ref().and_then(|kind| kind.name.as_deref()).or(self.object_type.as_deref())
    }

    /// Its property sets and quantities, then those of its type. Its own values take precedence.
    pub fn all_sets(&self) -> impl Iterator<Item = &Arc<PropertySet>> {
        self.sets.iter().chain(self.kind.iter().flat_map(|kind| &kind.sets))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        let shown = |x: f64, unit: Option<&str>| Value::Number(x, unit.map(str::to_owned)).to_string();
        assert_eq!(shown(2.009999999999999, Some("m")), "2.01 m");
        assert_eq!([shown(100.0, None), shown(0.0, None), shown(-0.0000001, None)], ["100", "0", "-1e-7"]);
        assert_eq!([shown(-1.5, Some("°")), shown(3e20, None)], ["-1.5 °", "3e20"]);
    }
}
