//! Material libraries (`.mtl`): transparency, colours and pictures.
//!
//! Based on: Wavefront Technologies, *MTL material format (Lightwave, OBJ)*, 1995. A material is see-through with `d` below 1,
//! `Tr` above 0, an opacity map, or an illumination model with refraction (6, 7), or with glass (4, 9) if the library gives no
//! opacity. `d` takes precedence over `Tr`: some exporters write `Tr 1` for opaque. Maya gives every material model 4 and its
//! transparency as `Tf`: `Tf 1 1 1` is opaque.

use enfilade::scene::whole_file::BYTE_ORDER_MARK;
use std::collections::HashMap;

/// A material of a library.
#[derive(Default)]
pub(super) struct Material {
    /// `Kd`: red, green and blue of a matt surface, 0 to 1.
    pub diffuse: Option<[f32; 3]>,
    /// `map_Kd`: the file name of a picture.
    pub picture: Option<String>,
    dissolve: Option<f64>,
    transparency: Option<f64>,
    illumination: Option<u32>,
    /// `Tf`: red, green and blue; in Maya 1 less the transparency.
    filter: Option<[f64; 3]>,
    /// `map_d`: the file name of a picture of opacity.
    opacity_map: Option<String>,
    /// Whether an earlier material of this name was see-through.
    was_see_through: bool,
}

impl Material {
    /// 0 (clear) to 1 (opaque).
    pub fn opacity(&self) -> f64 {
        self.dissolve.or(self.transparency.map(|tr| 1.0 - tr)).unwrap_or(1.0)
    }

    /// The files of its pictures.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        [&self.picture, &self.opacity_map].into_iter().flatten().map(String::as_str).filter(|name| !name.is_empty())
    }

    /// Whether things behind it may show.
    pub fn is_see_through(&self) -> bool {
        let is_clear = || self.dissolve.or(self.transparency).is_none() && self.filter != Some([1.0; 3]);
        let by_model = match self.illumination {
            Some(6 | 7) => true,
            Some(4 | 9) => is_clear(),
            _ => false,
        };
        self.opacity() < 1.0 || self.opacity_map.is_some() || by_model || self.was_see_through
    }
}

/// The file name of a map. Options such as `-s 1 1 1` come first; the name may have blanks.
fn file(rest: &str) -> String {
    let name = if rest.starts_with('-') { rest.split_ascii_whitespace().next_back() } else { None };
    name.unwrap_or(rest).to_owned()
}

/// Adds the materials of a library to `out`, by name. Of several with one name the last counts, but a see-through one stays so.
/// Unknown statements are skipped.
pub(super) fn read(bytes: &[u8], out: &mut HashMap<String, Material>) {
    let mut current: Option<(String, Material)> = None;
    let mut close = |material: Option<(String, Material)>| {
        if let Some((name, mut material)) = material {
            material.was_see_through = out.get(&name).is_some_and(Material::is_see_through);
            out.insert(name, material);
        }
    };
    for line in bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes).split(|&b| b == b'\n') {
        let line = String::from_utf8_lossy(line);
        let line = line.split('#').next().unwrap_or_default().trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        if keyword == "newmtl" {
            close(current.replace((rest.to_owned(), Material::default())));
            continue;
        }
        let Some((_, material)) = &mut current else { continue };
        // In `d -halo 0.5` the number comes last.
        let number = rest.split_ascii_whitespace().next_back();
        match keyword {
            "d" => material.dissolve = number.and_then(|n| n.parse().ok()),
            "Tr" => material.transparency = number.and_then(|n| n.parse().ok()),
            "illum" => material.illumination = number.and_then(|n| n.parse().ok()),
            "map_d" if !rest.is_empty() => material.opacity_map = Some(file(rest)),
            "Tf" => {
                let numbers: Vec<f64> = rest.split_ascii_whitespace().map_while(|n| n.parse().ok()).collect();
                // One number stands for all three.
                material.filter = if let [one] = numbers[..] { Some([one; 3]) } else { numbers.try_into().ok() };
            }
            "Kd" => {
                let numbers: Vec<f32> = rest.split_ascii_whitespace().map_while(|n| n.parse().ok()).collect();
                material.diffuse = numbers.try_into().ok();
            }
            "map_Kd" if !rest.is_empty() => material.picture = Some(file(rest)),
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
        let mut out = HashMap::new();
        read(library.as_bytes(), &mut out);
        let mut names: Vec<_> = out.iter().filter(|(_, m)| m.is_see_through()).map(|(name, _)| name.as_str()).collect();
        names.sort();
        assert_eq!(names, ["glass", "halo", "leaf", "ray", "thin"]);
    }

    /// Opaque and see-through materials as written by Maya, 3ds Max and Blender.
    #[test]
    fn what_exporters_write_for_opaque_is_opaque() {
        for (says, shows) in [
            ("illum 4\nKd 0.5 0.5 0.5\nTf 1.00 1.00 1.00\nNi 1.00", false),
            ("illum 4\nTf 0.40 0.40 0.40\nNi 1.00", true),
            ("illum 4\nTf 1\n", false),
            ("illum 4\nTf spectral x.rfl\n", true),
            ("Tr 0.0\nTf 1.0 1.0 1.0\nillum 2\nmap_d", false),
            ("illum 4", true),
            ("d 1.0\nillum 9", false),
            ("d 0.2\nillum 4\nTf 1 1 1", true),
            ("d 1.0\nillum 6", true),
        ] {
            let mut out = HashMap::new();
            read(format!("newmtl a\n{says}\n").as_bytes(), &mut out);
            assert_eq!(out["a"].is_see_through(), shows, "{says}");
        }
    }

    #[test]
    fn colours_and_pictures_are_read() {
        let library =
            "newmtl a\nKd 0.5 0.25 1\nmap_Kd my wall.png\nnewmtl b\nKd spectral x.rfl\nmap_Kd -s 2 2 1 wood.jpg\nTr 0.25\n";
        let mut out = HashMap::new();
        read(library.as_bytes(), &mut out);
        let [a, b] = ["a", "b"].map(|name| &out[name]);
        assert_eq!((a.diffuse, a.picture.as_deref(), a.opacity()), (Some([0.5, 0.25, 1.0]), Some("my wall.png"), 1.0));
        assert_eq!((b.diffuse, b.picture.as_deref(), b.opacity()), (None, Some("wood.jpg"), 0.75));
    }
}
