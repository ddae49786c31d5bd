use enfilade::geom::area;
use enfilade::vis::{bsp::Bsp, prt::read_prt};
#[test]
fn explore() {
    for name in ["dm4", "e1m1", "e1m3", "e2m2", "start"] {
        let bytes = std::fs::read(format!("/work/shared/data/quake-id-gpl/{name}.bsp")).unwrap();
        let bsp = Bsp::read(bytes).unwrap();
        let t = std::time::Instant::now();
        let d = bsp.level().unwrap();
        println!(
            "{name} {} leaves {} portals {} slivers {} rounding {} {:?}",
            bsp.format(),
            bsp.leaves(),
            d.level.portals.len(),
            d.slivers,
            bsp.rounding(),
            t.elapsed()
        );
        let mut widths: Vec<f64> = d.level.portals.iter().map(|p| area(&p.winding).sqrt()).collect();
        widths.sort_by(f64::total_cmp);
        println!("   sqrt areas {:?}", &widths[..widths.len().min(12)]);
        let mut isolated = vec![true; bsp.leaves()];
        for p in &d.level.portals {
            for c in p.cells {
                isolated[c as usize] = false;
            }
        }
        println!("   isolated {}", isolated.iter().filter(|x| **x).count());
        let rows = bsp.rows().unwrap().unwrap();
        println!(
            "   rows: ones {} of {}; mean {}",
            rows.count_ones(),
            rows.rows() * rows.rows(),
            rows.count_ones() as f64 / rows.rows() as f64
        );
        // adjacency must be in rows
        let mut missing = 0;
        let mut mwidth: f64 = 0.0;
        for p in &d.level.portals {
            let [a, b] = p.cells.map(|c| c as usize);
            if !rows.get(a, b) || !rows.get(b, a) {
                missing += 1;
                mwidth = mwidth.max(area(&p.winding));
            }
        }
        println!("   neighbours not in their rows {missing} max area {mwidth}");
        let self_missing = (0..rows.rows()).filter(|&c| !rows.get(c, c)).count();
        println!("   not itself {self_missing}");
        for prt in ["id_dm4", "id_e1m3"] {
            let p = read_prt(&std::fs::read(format!("/work/shared/data/prt/{prt}.prt")).unwrap()).unwrap();
            println!("   {prt}: {} {} fits {}", p.level.cells, p.level.portals.len(), bsp.fits(&p));
        }
    }
}
