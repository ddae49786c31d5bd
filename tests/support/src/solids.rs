//! Boxes with holes in them, as closed solids.

use glam::DVec3;

/// Least and greatest corner.
pub type Box3 = [DVec3; 2];

/// The box with another cut out of it: up to six boxes.
pub fn less([min, max]: Box3, [a, b]: Box3) -> Vec<Box3> {
    if !(a.cmplt(max).all() && min.cmplt(b).all()) {
        return vec![[min, max]];
    }
    let (mut low, mut high, mut out) = (min, max, Vec::new());
    for axis in 0..3 {
        if a[axis] > low[axis] {
            let mut top = high;
            top[axis] = a[axis];
            out.push([low, top]);
            low[axis] = a[axis];
        }
        if b[axis] < high[axis] {
            let mut bottom = low;
            bottom[axis] = b[axis];
            out.push([bottom, high]);
            high[axis] = b[axis];
        }
    }
    out
}
