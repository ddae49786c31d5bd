//! Levels of detail, found by names: `wall_LOD0`, `wall_LOD1`. The finest represents all.
//!
//! The names are those of Unity's importer (`_LOD0` and up), and of Unreal, O3DE and Second Life, whose finest level has no
//! number.

use std::collections::BTreeMap;

/// A node's place in a group of levels of detail.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Level {
    pub group: u32,
    /// Whether it represents its group.
    pub is_finest: bool,
}

/// Levels by node, from each node's parent and name. Nodes of one parent form a group if their names differ by level only; so do
/// nodes of different parents if each level occurs once.
pub(super) fn levels(nodes: &[(Option<usize>, &str)]) -> Vec<Option<Level>> {
    let mut found = vec![None; nodes.len()];
    let named: Vec<Option<(String, i32)>> = nodes.iter().map(|(_, name)| level(name)).collect();
    let (mut groups, mut next) = (BTreeMap::new(), 0);
    for (node, (parent, _)) in nodes.iter().enumerate() {
        if let Some((stem, level)) = &named[node] {
            groups.entry((*parent, stem.clone())).or_insert_with(Vec::new).push((*level, node));
        }
    }
    if groups.is_empty() {
        return found;
    }
    // The finest may have no number.
    for (node, (parent, name)) in nodes.iter().enumerate().filter(|(node, _)| named[*node].is_none()) {
        if let Some(group) = groups.get_mut(&(*parent, name.to_lowercase())) {
            group.push((-1, node));
        }
    }
    let mut by_stem: BTreeMap<String, Vec<(i32, usize)>> = BTreeMap::new();
    for ((_, stem), mut group) in groups {
        group.sort_unstable();
        if group[0].0 < group[group.len() - 1].0 {
            set_levels(&mut found, &group, next);
            next += 1;
        } else if !stem.is_empty() {
            by_stem.entry(stem).or_default().extend(group);
        }
    }
    for mut group in by_stem.into_values() {
        group.sort_unstable();
        if group.len() > 1 && group.windows(2).all(|pair| pair[0].0 < pair[1].0) {
            set_levels(&mut found, &group, next);
            next += 1;
        }
    }
    join_parts(&mut found, &named, next);
    found
}

/// Coarse levels with a finest level in parts: `wall_LOD2` beside `wall.0_LOD0` and `wall.1_LOD0`. Without a finest level, a
/// coarse one still counts as coarse if the model has finer levels of other things.
fn join_parts(found: &mut [Option<Level>], named: &[Option<(String, i32)>], mut next: u32) {
    let Some(finest) = named.iter().flatten().map(|(_, level)| *level).min() else { return };
    let coarse: Vec<usize> = (0..named.len())
        .filter(|&node| found[node].is_none() && named[node].as_ref().is_some_and(|(_, level)| *level > finest))
        .collect();
    for node in coarse {
        let Some((stem, _)) = &named[node] else { continue };
        let is_part = |(whole, level): &(String, i32)| {
            let rest = whole.strip_prefix(stem.as_str()).filter(|_| *level == finest);
            rest.is_some_and(|rest| rest.starts_with(|c: char| !c.is_alphanumeric()))
        };
        for part in 0..named.len() {
            if found[part].is_none() && named[part].as_ref().is_some_and(is_part) {
                found[part] = Some(Level { group: next, is_finest: true });
            }
        }
        found[node] = Some(Level { group: next, is_finest: false });
        next += 1;
    }
}

fn set_levels(found: &mut [Option<Level>], group: &[(i32, usize)], number: u32) {
    for &(level, node) in group {
        found[node] = Some(Level { group: number, is_finest: level == group[0].0 });
    }
}

/// The name without its level, in lower case, and the level.
fn level(name: &str) -> Option<(String, i32)> {
    let name = name.to_lowercase();
    // Blender adds `.001` to the names of copies.
    let (name, copy) = match name.rsplit_once('.') {
        Some((stem, digits)) if digits.len() >= 3 && digits.bytes().all(|b| b.is_ascii_digit()) && stem.contains("lod") => {
            (stem, digits)
        }
        _ => (name.as_str(), ""),
    };
    let is_separator = |c: char| !c.is_alphanumeric();
    let number = |text: &str| text.parse::<u8>().ok().filter(|_| text.len() <= 2).map(i32::from);
    let at = name.rfind("lod")?;
    let (before, after) = (&name[..at], name[at + 3..].trim_start_matches(is_separator));
    let stem = before.trim_end_matches(is_separator);
    if let Some(level) = number(after)
        && (stem.is_empty() || stem.len() < before.len())
    {
        return Some((format!("{stem}{copy}"), level));
    }
    // `LOD1_wall`.
    let digits = after.len() - after.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let rest = &after[digits..];
    let level = number(&after[..digits]).filter(|_| stem.is_empty() && rest.starts_with(is_separator))?;
    Some((format!("{}{copy}", rest.trim_start_matches(is_separator)), level))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_levels() {
        for (name, expected) in [
            ("wall_LOD0", Some(("wall", 0))),
            ("Wall_lod_2", Some(("wall", 2))),
            ("wall LOD1", Some(("wall", 1))),
            ("wall.LOD1", Some(("wall", 1))),
            ("wall_LOD1.001", Some(("wall001", 1))),
            ("LOD1", Some(("", 1))),
            ("LOD2_tree", Some(("tree", 2))),
            ("melod1", None),
            ("explode", None),
            ("wall_LOD", None),
            ("wall_LOD1234", None),
            ("wall", None),
        ] {
            assert_eq!(level(name), expected.map(|(stem, level)| (stem.to_owned(), level)), "{name}");
        }
    }

    #[test]
    fn levels_of_one_thing_form_a_group() {
        let finest = |levels: &[Option<Level>]| levels.iter().map(|l| l.map(|l| l.is_finest)).collect::<Vec<_>>();
        let of = |nodes: &[(Option<usize>, &str)]| finest(&levels(nodes));
        let (no, yes, lower) = (None, Some(true), Some(false));
        assert_eq!(of(&[(None, "a_LOD0"), (None, "a_LOD1"), (None, "b_LOD0"), (None, "c")]), [yes, lower, no, no]);
        assert_eq!(of(&[(None, "a"), (None, "a_LOD1"), (None, "a_LOD2")]), [yes, lower, lower], "no number is finest");
        assert_eq!(of(&[(Some(7), "a_LOD0"), (Some(8), "a_LOD1")]), [yes, lower], "under parents of their own");
        assert_eq!(of(&[(Some(7), "a_LOD0"), (Some(8), "a_LOD0")]), [no, no], "two copies of one level");
        assert_eq!(of(&[(Some(7), "LOD1"), (Some(7), "LOD2")]), [yes, lower], "whole groups of nodes");
        let parts = [(None, "a.0_LOD0"), (None, "a.1_LOD0"), (None, "a_LOD2"), (None, "ab_LOD0"), (None, "c_LOD1")];
        assert_eq!(of(&parts), [yes, yes, lower, no, lower], "the finest in parts, and none at all");
        let groups = levels(&[(None, "a_LOD0"), (None, "b_LOD0"), (None, "b_LOD1"), (None, "a_LOD1")]);
        assert_eq!(groups[0].unwrap().group, groups[3].unwrap().group);
        assert_ne!(groups[0].unwrap().group, groups[1].unwrap().group);
    }
}
