//! Material libraries (`.mtl`): which materials are see-through.
//!
//! Based on: Wavefront Technologies, *MTL material format (Lightwave, OBJ)*, 1995. `d` below 1, `Tr` above 0, an opacity map, or an
//! illumination model with glass or refraction (4, 6, 7, 9). Where `d` and `Tr` contradict each other `d` counts: some exporters
//! write `Tr 1` for opaque.

use std::collections::HashSet;

#[derive(Default)]
struct Material {
    dissolve: Option<f64>,
    transparency: Option<f64>,
    illumination: Option<u32>,
    has_opacity_map: bool,
}

impl Material {
    fn is_see_through(&self) -> bool {
        let thin = match (self.dissolve, self.transparency) {
            (Some(d), _) => d < 1.0,
            (None, Some(tr)) => tr > 0.0,
            (None, None) => false,
        };
        thin || self.has_opacity_map || matches!(self.illumination, Some(4 | 6 | 7 | 9))
    }
}

/// Adds the names of the see-through materials of a library to `out`. What isn't understood is skipped.
pub(super) fn see_through(bytes: &[u8], out: &mut HashSet<String>) {
    let mut current: Option<(String, Material)> = None;
    let mut close = |material: Option<(String, Material)>| {
        if let Some((name, _)) = material.filter(|(_, m)| m.is_see_through()) {
            out.insert(name);
        }
    };
    for line in bytes.split(|&b| b == b'\n') {
        let line = String::from_utf8_lossy(line);
        let line = line.split('#').next().unwrap_or_default().trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if keyword == "newmtl" {
            close(current.replace((rest.to_owned(), Material::default())));
            continue;
        }
        let Some((_, material)) = &mut current else { continue };
        // `d -halo 0.5` has its number last.
        let number = rest.split_ascii_whitespace().next_back();
        match keyword {
            "d" => material.dissolve = number.and_then(|n| n.parse().ok()),
            "Tr" => material.transparency = number.and_then(|n| n.parse().ok()),
            "illum" => material.illumination = number.and_then(|n| n.parse().ok()),
            "map_d" => material.has_opacity_map = true,
            _ => {}
        }
    }
    close(current);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn see_through_is_what_dissolves_transmits_or_refracts() {
        let library = "newmtl wall\nd 1.0\nTr 1\nnewmtl glass\r\nd 0.3\r\nnewmtl halo\nd -halo 0.5\nnewmtl thin # x\nTr 0.5\n\
                       newmtl solid\nTr 0\nillum 2\nnewmtl ray\nillum 7\nnewmtl leaf\nmap_d leaf.png\nnewmtl odd\nd x\n";
        let mut out = HashSet::new();
        see_through(library.as_bytes(), &mut out);
        let mut names: Vec<_> = out.into_iter().collect();
        names.sort();
        assert_eq!(names, ["glass", "halo", "leaf", "ray", "thin"]);
    }
}
