//! Maps against the levels that were compiled of them.
#![cfg(feature = "full")]

use super::cells;
use super::solids::{Solid, solids};
use crate::cli::folder;
use enfilade::cells::Locator;
use enfilade::scene::ImportOptions;
use enfilade_levels::quake::import_map_bytes;
use glam::DVec3;
use qbsp::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use testing::data::data;
use testing::random::Places;

/// Of `count` random points in the levels' boxes, those that the map and the compiled level do not both call free or both solid,
/// and whether the map calls them free.
fn disagreements(folder: &Path, name: &str, count: usize) -> Vec<(DVec3, bool)> {
    let read = |kind: &str| std::fs::read(folder.join(format!("quake-id-gpl/{name}.{kind}"))).unwrap();
    let bsp = read("bsp");
    let level = BspData::parse(BspParseInput { bsp: &bsp, lit: None, settings: BspParseSettings::default() }).unwrap();
    let scene = import_map_bytes(&read("map"), name, &ImportOptions::default()).unwrap();
    let graph = cells(&scene);
    let locator = Locator::new(&graph);
    let bounds = level.models[0].bound;
    let [min, max] = [bounds.min, bounds.max].map(|p| DVec3::from_array(p.to_array().map(f64::from)));
    let mut random = Places::new(11);
    let mut found = Vec::new();
    for _ in 0..count {
        let p = DVec3::from(std::array::from_fn(|k| min[k] + (max[k] - min[k]) * random.unit()));
        let leaf = level.leaf_at_point(0, p.as_vec3());
        let is_free = !level.leaves[leaf].contents.0.contains(qbsp::data::nodes::BspLeafContentFlags::SOLID);
        let in_cell = locator.locate(DVec3::new(p.x, p.z, -p.y) / 32.0 - scene.origin).is_some();
        if in_cell != is_free {
            found.push((p, in_cell));
        }
    }
    found
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn a_map_and_its_compiled_level_agree_on_what_is_solid() {
    let folder = data();
    for name in crate::levels::LEVELS {
        let found = disagreements(&folder, name, 100_000);
        assert!(found.len() < 100, "{name}: {} {:?}", found.len(), &found[..found.len().min(8)]);
    }
}

#[test]
#[ignore = "a million points; run by `just torture`"]
fn a_map_and_its_compiled_level_agree_in_a_million_points() {
    let folder = data();
    for name in crate::levels::LEVELS {
        let found = disagreements(&folder, name, 1_000_000);
        let text = std::fs::read(folder.join(format!("quake-id-gpl/{name}.map"))).unwrap();
        let (solids, _) = solids(&text.iter().map(|&b| char::from(b)).collect::<String>());
        let depth = |p: DVec3, solid: &Solid| solid.iter().map(|plane| plane.distance(p)).fold(f64::MIN, f64::max);
        // What is in no brush and not free is a pocket that no entity reaches, which the compiler kept.
        let (mut near, mut pockets) = (0, 0);
        for &(p, is_free) in &found {
            let nearest = solids.iter().map(|solid| depth(p, solid)).min_by(|a, b| a.abs().total_cmp(&b.abs()));
            let is_near = nearest.is_some_and(|d| d.abs() < 0.1);
            near += usize::from(is_near);
            pockets += usize::from(!is_near && !is_free && solids.iter().all(|solid| depth(p, solid) > 0.0));
        }
        println!("{name}: {} of 1,000,000, {near} within 0.1 of a face, {pockets} in closed pockets", found.len());
        assert!(found.len() - near - pockets < 10, "{name}");
        assert!(found.len() < 1000, "{name}: {}", found.len());
    }
}

/// A WAD of the textures that a level has within.
fn wad_of(bsp: &[u8]) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(bsp[at..at + 4].try_into().unwrap()) as usize;
    let [lump, length] = [word(4 + 8 * 2), word(8 + 8 * 2)];
    let mut wad = b"WAD2".to_vec();
    wad.extend((word(lump) as u32).to_le_bytes());
    wad.extend((12 + length as u32).to_le_bytes());
    wad.extend(&bsp[lump..lump + length]);
    for texture in 0..word(lump) {
        let at = word(lump + 4 + 4 * texture);
        // A lump ends where the file does, at the latest.
        wad.extend([12 + at as u32, 0, 0].map(u32::to_le_bytes).concat());
        wad.extend([0x44, 0, 0, 0]);
        wad.extend(&bsp[lump + at..lump + at + 16]);
    }
    wad
}

/// Corners of a triangle, metres in the model, and their texture coordinates.
type Textured = ([DVec3; 3], [[f32; 2]; 3]);

/// What the compiler wrote into the level is what is worked out of the map, to a texel's hundredth.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn textures_lie_in_a_map_as_its_compiler_laid_them() {
    let data = data();
    let level = data.join("quake-id-gpl/e1m1.bsp");
    let folder = folder("map_textures");
    std::fs::write(folder.join("base.wad"), wad_of(&std::fs::read(&level).unwrap())).unwrap();
    std::fs::copy(level.with_extension("map"), folder.join("e1m1.map")).unwrap();
    let options = ImportOptions { trace: true, ..ImportOptions::default() };
    let scenes = [folder.join("e1m1.map"), level].map(|path| enfilade_formats::import(&path, &options).unwrap());
    // By texture: corners in the model's own coordinates, with their texture coordinates.
    let [map, bsp] = scenes.map(|scene| {
        let trace = scene.trace.as_ref().unwrap();
        let mut of: BTreeMap<String, Vec<Textured>> = BTreeMap::new();
        for (o, object) in scene.objects.iter().enumerate() {
            let look = &trace.looks[trace.meshes[o] as usize];
            let material = &trace.materials[look.material.unwrap() as usize];
            for t in object.triangles.clone().filter(|_| material.texture.is_some()) {
                let at = look.texture_coordinates[trace.triangles[t as usize] as usize];
                of.entry(material.name.clone()).or_default().push((scene.corners(t as usize).map(|p| p + scene.origin), at));
            }
        }
        of
    });
    // Texture coordinates of a point of a triangle; `None` off it.
    let at = |(corners, at): &Textured, p: DVec3| {
        let [a, b, c] = *corners;
        let n = (b - a).cross(c - a);
        let weights = [(b, c), (c, a), (a, b)].map(|(q, r)| (q - p).cross(r - p).dot(n) / n.dot(n));
        let is_on = (p - a).dot(n.normalize()).abs() < 1e-3 && weights.iter().all(|w| *w > 1e-3);
        is_on.then(|| [0, 1].map(|k| (0..3).map(|i| weights[i] * f64::from(at[i][k])).sum::<f64>()))
    };
    let (mut compared, mut off) = (0, 0);
    for (texture, triangles) in &map {
        for (corners, coordinates) in triangles {
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let here = at(&(*corners, *coordinates), middle);
            let there = bsp.get(texture).and_then(|all| all.iter().find_map(|other| at(other, middle)));
            if let (Some(here), Some(there)) = (here, there) {
                compared += 1;
                // Pictures repeat.
                let apart = [0, 1].map(|k| (here[k] - there[k]) - (here[k] - there[k]).round());
                off += usize::from(apart.iter().any(|x| x.abs() > 1e-4));
            }
        }
    }
    assert!(compared > 3000, "{compared} triangles are in both");
    // One face, of two triangles, is of two brushes that the mapper offset differently.
    assert_eq!(off, 2, "of {compared} triangles");
}
