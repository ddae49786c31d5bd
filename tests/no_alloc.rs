//! A frame takes no memory: in a binary of its own, since the counter is the allocator of all of it.

mod boxes;

use enfilade::runtime::{Camera, Culler, Mode, Scratch};
use glam::DVec3;
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

#[test]
fn culling_allocates_nothing() {
    let (_, file) = boxes::flat().0.finish();
    let culler = Culler::new(&file);
    for mode in Mode::ALL {
        let mut scratch = Scratch::for_culler(&culler);
        // The first frame too: the scratch has its final size from the start. Memory that is taken and given back counts.
        MEMORY.reset_peak_usage();
        let before = MEMORY.peak_usage();
        for turn in 0..200 {
            let (sin, cos) = (f64::from(turn) * 0.1).sin_cos();
            let eye = boxes::p(1.5 + f64::from(turn % 9), 1.6, 4.0 + sin * 1.5) - file.origin;
            let camera = Camera::look_at(eye, eye + DVec3::new(cos, 0.0, sin), 1.2, 1.6);
            std::hint::black_box(culler.cull(&camera, mode, &mut scratch).objects.len());
        }
        assert_eq!(MEMORY.peak_usage(), before, "{mode}");
        // The alarm works.
        drop(std::hint::black_box(vec![0u8; 100]));
        assert!(MEMORY.peak_usage() > before);
    }
}
