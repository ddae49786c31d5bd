//! Portals' places: the ridges between two regions of voxels, each a connected patch with a plane fitted to it.
//!
//! The sum of the normals of a patch's voxel faces is the area vector of its rim, whatever way the staircase takes between; so
//! it is the normal of the best plane without a fit. A plane that is nearly upright, level or parallel to a wall is made so,
//! and one that lies within a voxel and a half of a wall's plane becomes that: doorways get portals that are flush with walls.

use super::grid::Grid;
use super::labels::{Labels, VOID, VoxelFace};
use crate::cells::bsp::adjacency::{Contact, Flat, open_around, push};
use crate::cells::bsp::planes::Shell;
use crate::cells::bsp::tree::{Bsp, reach};
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::locate::BoxTree;
use crate::geom::{Aabb, Plane, area};
use crate::parallel;
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// A patch of fewer voxels than this across isn't halved.
const SMALLEST: f64 = 10.0;

/// A plane that parts two regions near a patch.
#[derive(Clone)]
pub struct Ridge {
    /// The regions, behind the plane and in front of it.
    pub regions: [u32; 2],
    /// The plane.
    pub plane: Plane,
    /// Where on the plane, as a rectangle.
    pub corners: [DVec3; 4],
    /// How far off the plane the patch strays, metres.
    pub depth: f64,
}

/// A patch of fewer faces is none.
const LEAST_FACES: usize = 3;
/// Normals nearer than this to an axis or a wall are made parallel: cosine of 20 degrees.
const SNAP_COSINE: f64 = 0.94;
/// Normals whose vertical part is less than this are made level: up to 30 degrees, as those square to most ramps are.
const UPRIGHT_NORMAL: f64 = 0.5;
/// Planes of walls within this many voxels are taken.
const FLUSH: f64 = 1.5;
/// Most voxels that labels are straightened off a plane.
const DEEPEST: f64 = 4.0;

/// A patch that strays farther from its plane is halved, at most so many times over.
const MOST_HALVINGS: u32 = 3;
/// Where one plane has this share of what is open, it is the ridge's.
const MOST_OF_IT: f64 = 0.5;

/// A place on a patch, metres, and its area times its normal from the lower region to the higher, square metres.
type Step = (DVec3, DVec3);

/// What planes are fitted against.
pub struct Fitter<'s> {
    shell: &'s Shell,
    tree: BoxTree,
    /// The grid's axes.
    axes: [DVec3; 3],
    voxel: f64,
}

impl<'s> Fitter<'s> {
    /// For a shell and a grid.
    pub fn new(shell: &'s Shell, grid: &Grid) -> Self {
        let boxes: Vec<Aabb> = shell.triangles.iter().map(|(t, _)| Aabb::of(*t)).collect();
        let tree = BoxTree::new(&boxes, (0..boxes.len() as u32).collect());
        Self { shell, tree, axes: DVec3::AXES.map(|a| grid.frame.direction(a)), voxel: grid.frame.voxel }
    }

    /// Ridges between regions of voxels, ordered by regions.
    pub fn ridges(&self, grid: &Grid, labels: &Labels) -> Vec<Ridge> {
        const CHUNK: usize = 1024;
        // Regions, the middle in half voxels, and across which axis, negative where the lower region lies above.
        type Met = ([u32; 2], [i32; 3], i8);
        let chunk = |c: usize| {
            let mut out: Vec<Met> = Vec::new();
            for brick in c * CHUNK..((c + 1) * CHUNK).min(grid.len()) {
                labels.contacts(grid, None, brick, &mut |VoxelFace { labels: [a, b], at, axis, .. }| {
                    if a < VOID && b < VOID {
                        let at = (2.0 * at).to_array().map(|x| x as i32);
                        let axis = axis as i8 + 1;
                        out.push(([a.min(b), a.max(b)], at, if a < b { axis } else { -axis }));
                    }
                });
            }
            out
        };
        let mut met: Vec<Met> = parallel::flat_map_range(0..grid.len().div_ceil(CHUNK), chunk);
        parallel::sort(&mut met);
        let (frame, face) = (&grid.frame, self.voxel * self.voxel);
        let to_world = |patch: Vec<(DVec3, DVec3)>| -> Vec<Step> {
            patch.into_iter().map(|(at, n)| (frame.to_world(at), frame.direction(n) * face)).collect()
        };
        let step = |&(_, at, axis): &Met| {
            let n = DVec3::AXES[usize::from(axis.unsigned_abs()) - 1] * f64::from(axis.signum());
            (DVec3::from_array(at.map(f64::from)) * 0.5, n)
        };
        let of_pair = |met: &[Met]| {
            let patches = patches(met.iter().map(step).collect());
            let mut out = Vec::new();
            for patch in patches.into_iter().filter(|p| p.len() >= LEAST_FACES) {
                self.fit_all(met[0].0, to_world(patch), MOST_HALVINGS, &mut out);
            }
            out
        };
        let pairs: Vec<&[Met]> = met.chunk_by(|a, b| a.0 == b.0).collect();
        parallel::flat_map(&pairs, |pair| of_pair(pair))
    }

    /// Ridges where leaves of two regions meet on several planes.
    pub fn between_leaves(&self, bsp: &Bsp, contacts: &[Contact], labels: &[Option<u32>]) -> Vec<Ridge> {
        let mut by_pair: BTreeMap<[u32; 2], Vec<&Contact>> = BTreeMap::new();
        for c in contacts.iter().filter(|c| c.wide) {
            if let [Some(a), Some(b)] = c.leaves.map(|l| labels[l as usize])
                && a != b
            {
                by_pair.entry([a.min(b), a.max(b)]).or_default().push(c);
            }
        }
        let mut patches: Vec<([u32; 2], Vec<&Contact>)> = Vec::new();
        for (pair, of_pair) in by_pair {
            // What shares a leaf is one patch.
            let mut first: HashMap<u32, u32> = HashMap::new();
            let mut set = DisjointSets::new(of_pair.len());
            for (i, c) in of_pair.iter().enumerate() {
                for leaf in c.leaves {
                    let other = *first.entry(leaf).or_insert(i as u32);
                    set.join(other, i as u32);
                }
            }
            let mut groups: BTreeMap<u32, Vec<&Contact>> = BTreeMap::new();
            for (i, c) in of_pair.into_iter().enumerate() {
                groups.entry(set.find(i as u32)).or_default().push(c);
            }
            patches.extend(groups.into_values().map(|g| (pair, g)));
        }
        let of_patch = |&(pair, ref patch): &([u32; 2], Vec<&Contact>)| {
            let plane = |c: &Contact| bsp.nodes[c.node as usize].plane;
            let mut areas: BTreeMap<[u64; 4], (Plane, f64)> = BTreeMap::new();
            let mut steps: Vec<Step> = Vec::new();
            for c in patch {
                let p = plane(c);
                let key = [p.n.x, p.n.y, p.n.z, p.d].map(|x| (x + 0.0).to_bits());
                areas.entry(key).or_insert((p, 0.0)).1 += c.open_area;
                let forward = labels[c.leaves[0] as usize] == Some(pair[0]);
                let n = p.n * (c.open_area / c.polygon.len() as f64) * if forward { 1.0 } else { -1.0 };
                let flat = Flat::new(&p, self.axes[0]);
                steps.extend(c.polygon.iter().map(|&q| (flat.from(q), n)));
            }
            let mut out = Vec::new();
            if areas.len() > 1 {
                let all: f64 = areas.values().map(|a| a.1).sum();
                let best = areas.into_values().max_by(|a, b| a.1.total_cmp(&b.1));
                match best.filter(|b| b.1 >= MOST_OF_IT * all) {
                    Some((p, _)) => out.push(self.around(pair, &steps, p, false)),
                    None => self.fit_all(pair, steps, MOST_HALVINGS, &mut out),
                }
            }
            out
        };
        parallel::flat_map(&patches, of_patch)
    }

    /// A ridge, or those of both halves of a patch that no plane is near to.
    fn fit_all(&self, regions: [u32; 2], steps: Vec<Step>, halvings: u32, out: &mut Vec<Ridge>) {
        let found = self.fit(regions, &steps);
        let bounds = Aabb::of(steps.iter().map(|s| s.0));
        let size = bounds.diagonal();
        let deep = found.as_ref().is_none_or(|r| r.depth - self.voxel > DEEPEST * size);
        if !deep || halvings == 0 || size < SMALLEST * self.voxel {
            out.extend(found);
            return;
        }
        let axis = (0..3).max_by(|&a, &b| bounds.size()[a].total_cmp(&bounds.size()[b])).unwrap_or(0);
        let middle = bounds.centre()[axis];
        let (a, b): (Vec<Step>, Vec<Step>) = steps.into_iter().partition(|s| s.0[axis] < middle);
        self.fit_all(regions, a, halvings - 1, out);
        self.fit_all(regions, b, halvings - 1, out);
    }

    fn fit(&self, regions: [u32; 2], steps: &[Step]) -> Option<Ridge> {
        let voxel = self.voxel;
        let sum = steps.iter().map(|s| s.1).sum::<DVec3>();
        if sum.length() < voxel * voxel {
            return None;
        }
        let mut n = sum.normalize();
        // Upright, where nearly so.
        if n.y.abs() < UPRIGHT_NORMAL {
            n = n.with_y(0.0).normalize();
        }
        for axis in self.axes {
            if n.dot(axis).abs() > SNAP_COSINE {
                n = axis * n.dot(axis).signum();
            }
        }
        let weight: f64 = steps.iter().map(|s| s.1.length()).sum();
        let centre = steps.iter().map(|s| s.0 * s.1.length()).sum::<DVec3>() / weight;
        // Flush with a wall.
        let near = Aabb::of(steps.iter().map(|s| s.0)).inflated(2.0 * voxel);
        let mut walls: BTreeMap<u32, f64> = BTreeMap::new();
        self.tree.in_box(&near, &mut |i| {
            let (t, p) = &self.shell.triangles[i as usize];
            let wall = &self.shell.planes[*p as usize];
            if wall.n.dot(n).abs() > SNAP_COSINE && wall.distance(centre).abs() <= FLUSH * voxel {
                *walls.entry(*p).or_default() += area(t);
            }
        });
        let best = walls.into_iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        Some(match best.filter(|w| w.1 >= (0.5 * voxel).powi(2)) {
            Some((wall, _)) => {
                let plane = self.shell.planes[wall as usize];
                self.around(regions, steps, plane, plane.n.dot(n) < 0.0)
            }
            None => self.around(regions, steps, Plane::through(centre, n), false),
        })
    }

    /// The ridge on a plane around a patch.
    fn around(&self, regions: [u32; 2], steps: &[Step], plane: Plane, flipped: bool) -> Ridge {
        let flat = Flat::new(&plane, self.axes[0]);
        let (mut low, mut high, mut depth) = (DVec2::INFINITY, DVec2::NEG_INFINITY, 0.0f64);
        for &(p, _) in steps {
            let q = flat.to(p);
            (low, high, depth) = (low.min(q), high.max(q), depth.max(plane.distance(p).abs()));
        }
        (low, high) = (low - self.voxel, high + self.voxel);
        let corners = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)].map(|q| flat.from(q));
        let regions = if flipped { [regions[1], regions[0]] } else { regions };
        Ridge { regions, plane, corners, depth: depth + self.voxel }
    }
}

/// Faces that touch or nearly touch, together; in voxels.
fn patches(steps: Vec<(DVec3, DVec3)>) -> Vec<Vec<(DVec3, DVec3)>> {
    let cell = |p: DVec3| (p / 2.0).floor().to_array().map(|x| x as i64);
    let mut cells: HashMap<[i64; 3], u32> = HashMap::new();
    for (at, _) in &steps {
        let next = cells.len() as u32;
        cells.entry(cell(*at)).or_insert(next);
    }
    let mut set = DisjointSets::new(cells.len());
    for (c, &i) in &cells {
        for k in 0..27 {
            if let Some(&j) = cells.get(&[c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1]) {
                set.join(i, j);
            }
        }
    }
    let mut out: BTreeMap<u32, Vec<(DVec3, DVec3)>> = BTreeMap::new();
    for step in steps {
        out.entry(set.find(cells[&cell(step.0)])).or_default().push(step);
    }
    out.into_values().collect()
}

/// Leaves on the wrong side of a ridge that hang together and reach it go over to the other region, where that makes less
/// open between regions.
pub fn straighten(bsp: &Bsp, contacts: &[Contact], ridges: &[Ridge], leaves: &mut [Option<u32>]) {
    let (around, rim) = (open_around(contacts, leaves.len()), bsp.leaves_at_rim());
    for ridge in ridges {
        let [a, b, _, d] = ridge.corners;
        let (u, v) = (b - a, d - a);
        let within = |p: DVec3| {
            let (x, y) = ((p - a).dot(u) / u.length_squared(), (p - a).dot(v) / v.length_squared());
            (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y) && ridge.plane.distance(p).abs() <= ridge.depth
        };
        for side in 0..2 {
            // Leaves of the region that should lie on the other side.
            let (here, there) = (Some(ridge.regions[1 - side]), Some(ridge.regions[side]));
            let outward = if side == 0 { ridge.plane } else { ridge.plane.flipped() };
            let astray = |leaf: u32, leaves: &[Option<u32>]| {
                let poly = &bsp.leaves[leaf as usize].poly;
                leaves[leaf as usize] == here
                    && !rim[leaf as usize]
                    && poly.faces.iter().all(|f| reach(&f.points, &outward).1 <= bsp.thin)
                    && within(poly.middle())
            };
            let mut found = Vec::new();
            push(bsp, bsp.root, ridge.corners.to_vec(), -outward.n, bsp.thin, &mut found);
            let mut seeds: Vec<u32> = found.into_iter().map(|f| f.0).collect();
            seeds.sort_unstable();
            seeds.dedup();
            let mut seen: BTreeSet<u32> = BTreeSet::new();
            for seed in seeds {
                if seen.contains(&seed) || !astray(seed, leaves) {
                    continue;
                }
                // What hangs together, and what is open between it and the rest of its region, and of the other.
                let mut group = vec![seed];
                seen.insert(seed);
                let (mut gained, mut lost, mut next) = (0.0, 0.0, 0);
                while next < group.len() {
                    let leaf = group[next];
                    next += 1;
                    for &i in &around[leaf as usize] {
                        let c = &contacts[i as usize];
                        let other = c.leaves[usize::from(c.leaves[0] == leaf)];
                        if leaves[other as usize] == there {
                            gained += c.open_area;
                        } else if leaves[other as usize] == here {
                            if astray(other, leaves) {
                                if seen.insert(other) {
                                    group.push(other);
                                }
                            } else {
                                lost += c.open_area;
                            }
                        }
                    }
                }
                if gained > lost {
                    group.into_iter().for_each(|l| leaves[l as usize] = there);
                }
            }
        }
    }
}
