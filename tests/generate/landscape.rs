//! Landscapes as portal files: their portals against the plan, and what is seen over their hills.

use enfilade::math::geom::newell;
use enfilade_levels::prt::read_prt;
use enfilade_levels::{VisOptions, vis_rows};
use enfilade_scenes::{LANDSCAPE_CLUSTERS, landscape};
use glam::DVec3;
use std::collections::BTreeSet;

#[test]
fn portals_stand_between_their_columns_and_end_at_the_sky() {
    let made = landscape(400, 3).unwrap();
    assert!(made == landscape(400, 3).unwrap() && made.prt != landscape(400, 4).unwrap().prt);
    let level = read_prt(made.prt.as_bytes()).unwrap().level;
    assert_eq!((level.cells, level.portals.len()), (made.clusters, made.portals));
    assert!(made.clusters < 400 && made.clusters > 300, "hills take {} clusters", 400 - made.clusters);
    let mut pairs = BTreeSet::new();
    let mut ends = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; level.cells];
    for portal in &level.portals {
        assert!(pairs.insert(portal.cells), "one portal between two columns");
        assert!(portal.winding.iter().flat_map(|p| p.to_array()).all(|x| x % 8.0 == 0.0 && (0.0..=32768.0).contains(&x)));
        let top = portal.winding.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        assert_eq!(portal.winding.iter().filter(|p| p.z == top).count(), 2);
        assert_eq!(top, 2456.0);
        for cell in portal.cells {
            let [min, max] = &mut ends[cell as usize];
            portal.winding.iter().for_each(|&p| (*min, *max) = (min.min(p), max.max(p)));
        }
    }
    // A portal's normal points towards the column with the greater coordinates, and no column reaches into another.
    for portal in &level.portals {
        let n = newell(&portal.winding).normalize().round();
        let [a, b] = portal.cells.map(|cell| ends[cell as usize]);
        let at = portal.winding[0].dot(n);
        assert!(n == DVec3::X || n == DVec3::Y, "{n}");
        assert!(a[1].dot(n) <= at && b[0].dot(n) >= at, "{portal:?}");
    }
}

#[test]
fn most_clusters_see_each_other_and_none_is_left_open() {
    let made = landscape(120, 1).unwrap();
    let level = read_prt(made.prt.as_bytes()).unwrap().level;
    let rows = vis_rows(&level, &VisOptions::default(), &enfilade::job::Job::quiet()).unwrap();
    let all = (level.cells * level.cells) as u64;
    assert_eq!(rows.lower_pairs, rows.upper_pairs);
    assert!(rows.upper_pairs > all / 2 && rows.upper_pairs < all * 19 / 20, "{} of {all}", rows.upper_pairs);
}

#[test]
fn numbers_of_clusters_are_limited() {
    for clusters in [0, LANDSCAPE_CLUSTERS.start() - 1, LANDSCAPE_CLUSTERS.end() + 1] {
        assert!(landscape(clusters, 0).unwrap_err().to_string().contains("2 to 100000"));
    }
}
