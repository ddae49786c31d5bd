//! A frame takes no memory: in a binary of its own, since the counter is the allocator of all of it. What the test's thread
//! takes counts, not what the harness takes beside it.

mod boxes;

use allocation_counter::measure;
use enfilade::runtime::{Camera, Culler, Mode, Scratch};
use glam::DVec3;

#[test]
fn culling_allocates_nothing() {
    let (_, file) = boxes::flat().0.finish();
    let culler = Culler::new(&file);
    for mode in Mode::ALL {
        let mut scratch = Scratch::for_culler(&culler);
        // The first frame too: the scratch has its final size from the start. Memory that is taken and given back counts.
        let taken = measure(|| {
            for turn in 0..200 {
                let (sin, cos) = (f64::from(turn) * 0.1).sin_cos();
                let eye = boxes::p(1.5 + f64::from(turn % 9), 1.6, 4.0 + sin * 1.5) - file.origin;
                let camera = Camera::look_at(eye, eye + DVec3::new(cos, 0.0, sin), 1.2, 1.6);
                std::hint::black_box(culler.cull(&camera, mode, &mut scratch).objects.len());
            }
        });
        assert_eq!(taken.count_total, 0, "{mode}");
    }
    // The alarm works.
    assert_eq!(measure(|| drop(std::hint::black_box(vec![0u8; 100]))).bytes_max, 100);
}
