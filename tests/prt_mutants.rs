//! Damaged portal files: no panic, and memory in proportion to the file. A binary of its own, because memory is counted for the
//! whole process.

use allocation_counter::measure;
use enfilade_levels::prt::read_prt;
use proptest::prelude::*;
use testing::prt_texts::{PRT1, PRT1_AM, PRT2};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever is done to a file, reading ends, with memory in proportion to it.
    #[test]
    fn mutants_never_panic(
        which in 0usize..3,
        edits in prop::collection::vec((any::<prop::sample::Index>(), "[-0-9().e \\n]{0,12}", 0usize..8), 1..6),
    ) {
        let mut text = [PRT1, PRT2, PRT1_AM][which].to_owned();
        for (at, by, gone) in edits {
            let at = at.index(text.len());
            text.replace_range(at..(at + gone).min(text.len()), &by);
        }
        let mut result = None;
        let taken = measure(|| result = Some(read_prt(text.as_bytes()))).bytes_max;
        // A PRT1 may promise this many isolated clusters; the list of its leaves is all that is taken for them.
        prop_assert!(taken < 64 * 1024);
        if let Some(Ok(prt)) = result {
            prop_assert!(prt.level.portals.iter().all(|p| p.cells.iter().all(|&c| (c as usize) < prt.level.cells)));
            prop_assert!(prt.leaves.iter().all(|&c| (c as usize) < prt.level.cells));
        }
    }
}
