//! What a model says of its elements and spaces beside their shape: [`crate::elements()`] reads it on demand, and an import knows nothing of it.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

/// The elements and spaces of a file.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Elements {
    /// In file order.
    pub all: Vec<Element>,
    /// What was left out, one line each.
    pub notes: Vec<String>,
    by_id: HashMap<String, usize>,
}

/// An element or a space.
#[derive(Clone, PartialEq, Debug)]
pub struct Element {
    /// Its GlobalId, or `#` and the record's number where it has none. It is the [`node`](enfilade::scene::Object::node) of its objects, and
    /// the `source` of a space's cell.
    pub global_id: String,
    /// `IfcWallStandardCase`, ...
    pub class: String,
    /// `Name`.
    pub name: Option<String>,
    /// `LongName`, which spaces have.
    pub long_name: Option<String>,
    /// `Tag`, which elements have: their number in the program that wrote the file.
    pub tag: Option<String>,
    /// `ObjectType`: a type in words.
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
    /// Its property sets, which its elements have, too.
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
    /// Words; lists with commas between, `true`, `false` or `unknown`.
    Text(String),
    /// A finite number, and the symbol of its unit where it has one: `m²`, `°`, ...
    Number(f64, Option<String>),
}

/// More decimals of a number aren't told: programs write 2.01 as 2.009999999999999.
const DECIMALS: usize = 6;
/// Numbers that are less than this would be told as 0 with [`DECIMALS`]; those above the second have too many digits to be read.
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
    /// Puts together what was read. Of several elements with one GlobalId, the first is found by it.
    #[cfg(feature = "ifc")]
    pub(crate) fn new(all: Vec<Element>, notes: Vec<String>) -> Self {
        let mut by_id = HashMap::with_capacity(all.len());
        for (i, element) in all.iter().enumerate() {
            by_id.entry(element.global_id.clone()).or_insert(i);
        }
        Self { all, notes, by_id }
    }

    /// The element with a GlobalId: that of an object by its `node`, that of a space by its cell's `source`.
    pub fn get(&self, global_id: &str) -> Option<&Element> {
        self.by_id.get(global_id).map(|&i| &self.all[i])
    }
}

impl Element {
    /// What its type is called; without a type, `ObjectType`.
    pub fn type_name(&self) -> Option<&str> {
        self.kind.as_ref().and_then(|kind| kind.name.as_deref()).or(self.object_type.as_deref())
    }

    /// Its property sets and quantities, then those of its type. What both tell, the element's own overrides.
    pub fn all_sets(&self) -> impl Iterator<Item = &Arc<PropertySet>> {
        self.sets.iter().chain(self.kind.iter().flat_map(|kind| &kind.sets))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_as_a_person_writes_them() {
        let told = |x: f64, unit: Option<&str>| Value::Number(x, unit.map(str::to_owned)).to_string();
        assert_eq!(told(2.009999999999999, Some("m")), "2.01 m");
        assert_eq!([told(100.0, None), told(0.0, None), told(-0.0000001, None)], ["100", "0", "-1e-7"]);
        assert_eq!([told(-1.5, Some("°")), told(3e20, None)], ["-1.5 °", "3e20"]);
    }
}
