//! Meshes bent by skeletons and morph targets: their vertices in the file's pose, and bounds of all poses.
//!
//! Based on: Khronos Group, *glTF 2.0 Specification*, 2021 (3.7.2.2 morph targets, 3.7.3 skins): a skinned mesh follows its
//! joints and ignores the transform of its node. A bent vertex is a weighted mean of its places by single joints, so bounds of
//! these hold it.

use super::data::{Buffers, broken, entry};
use super::document::{Document, Primitive, Skin};
use super::motion::{Motion, corners};
use super::primitive::Part;
use enfilade::math::geom::Aabb;
use enfilade::scene::ImportError;
use glam::{DAffine3, DMat4, DVec3};

/// Limit of reads per byte of the file, since morph targets may share bytes. More: small files take long. Less: no known limit.
const MOST_TIMES: usize = 64;

/// Vertices of a primitive in the node's own coordinates.
pub(super) struct Morphed {
    /// With the file's weights.
    pub positions: Vec<DVec3>,
    /// Range of each vertex, if an animation changes weights.
    pub range: Option<Vec<[DVec3; 2]>>,
}

/// Applies morph targets. `weights`: of the node, else of its mesh; `ranges`: see [`Motion::weights`]; `spent` counts reads.
pub(super) fn morph(
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    part: &Part,
    weights: &[f64],
    ranges: Option<&[[f64; 2]]>,
    spent: &mut usize,
) -> Result<Morphed, ImportError> {
    let mut positions = part.positions.clone();
    let ranges = ranges.filter(|_| !primitive.targets.is_empty());
    let mut range = ranges.map(|_| part.positions.iter().map(|&p| [p, p]).collect::<Vec<_>>());
    for (k, target) in primitive.targets.iter().enumerate() {
        let weight = weights.get(k).copied().unwrap_or(0.0);
        let ends = ranges.and_then(|ranges| ranges.get(k)).copied().unwrap_or([weight; 2]);
        let Some(accessor) = target.position.filter(|_| weight != 0.0 || ends != [0.0; 2]) else { continue };
        let offsets = buffers.accessor(accessor, &["VEC3"])?;
        *spent += part.vertices.len();
        if *spent / MOST_TIMES > buffers.size() + (1 << 20) {
            return Err(broken("morph targets that repeat their bytes"));
        }
        for (i, &vertex) in part.vertices.iter().enumerate() {
            let offset = offsets.get(vertex as usize).map(|[x, y, z, _]| DVec3::new(x, y, z));
            let offset = offset.ok_or_else(|| broken(format!("morph target {k}: no vertex {vertex}")))?;
            positions[i] += weight * offset;
            if let Some(range) = &mut range {
                let [a, b] = ends.map(|w| w * offset);
                range[i] = [range[i][0] + a.min(b), range[i][1] + a.max(b)];
            }
        }
    }
    Ok(Morphed { positions, range })
}

/// The joints of a skin.
pub(super) struct Joints {
    nodes: Vec<usize>,
    /// From the mesh to each joint's coordinates.
    inverse: Vec<DAffine3>,
    /// From there to the world, in the file's pose.
    rest: Vec<DAffine3>,
    /// Whether an animation moves any of them.
    pub moves: bool,
}

impl Joints {
    pub fn read(
        document: &Document,
        buffers: &Buffers<'_>,
        skin: &Skin,
        motion: &Motion,
        root: DAffine3,
    ) -> Result<Self, ImportError> {
        let n = document.node_count();
        if let Some(bad) = skin.joints.iter().find(|&&joint| joint >= n) {
            return Err(broken(format!("a skin has joint {bad}, there are {n} nodes")));
        }
        let matrices = skin.inverse_bind_matrices.map(|index| buffers.accessor(index, &["MAT4"])).transpose()?;
        let inverse = |i: usize| match &matrices {
            None => Ok(DAffine3::IDENTITY),
            Some(matrices) => {
                let matrix = matrices.matrix(i).ok_or_else(|| broken("a skin with fewer matrices than joints"))?;
                Ok(DAffine3::from_mat4(DMat4::from_cols_array(&matrix)))
            }
        };
        let inverse = (0..skin.joints.len()).map(inverse).collect::<Result<Vec<_>, ImportError>>()?;
        let rest = skin.joints.iter().map(|&joint| motion.rest(document, joint, root)).collect::<Result<Vec<_>, _>>()?;
        let moves = skin.joints.iter().any(|&joint| motion.carries(joint));
        Ok(Self { nodes: skin.joints.clone(), inverse, rest, moves })
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }
}

/// Joints and weights of each vertex of a part; weights add up to 1.
pub(super) struct Weights(Vec<Vec<(usize, f64)>>);

impl Weights {
    /// `None` if the primitive has none, or has them in an unsupported form.
    pub fn read(
        buffers: &Buffers<'_>,
        primitive: &Primitive,
        part: &Part,
        joints: usize,
    ) -> Result<Option<Self>, ImportError> {
        let attributes = &primitive.attributes;
        let pairs = [(attributes.joints, attributes.weights), (attributes.more_joints, attributes.more_weights)];
        let mut of_vertex = vec![Vec::new(); part.vertices.len()];
        for (joint, weight) in pairs.into_iter().filter_map(|(joint, weight)| joint.zip(weight)) {
            // Draco compression stores these elsewhere.
            if entry(&buffers.document().accessors, joint, "accessor")?.buffer_view.is_none() {
                return Ok(None);
            }
            let (numbers, weights) = (buffers.accessor(joint, &["VEC4"])?, buffers.accessor(weight, &["VEC4"])?);
            for (of_vertex, &vertex) in of_vertex.iter_mut().zip(&part.vertices) {
                let both = numbers.get(vertex as usize).zip(weights.get(vertex as usize));
                let (numbers, weights) = both.ok_or_else(|| broken(format!("no joints for vertex {vertex}")))?;
                for (joint, weight) in numbers.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
                    if joint < 0.0 || joint >= joints as f64 {
                        return Err(broken(format!("vertex {vertex} has joint {joint}, the skin has {joints}")));
                    }
                    of_vertex.push((joint as usize, weight));
                }
            }
        }
        if attributes.joints.is_none() || joints == 0 {
            return Ok(None);
        }
        for of_vertex in &mut of_vertex {
            let sum: f64 = of_vertex.iter().map(|(_, weight)| weight).sum();
            if sum.is_finite() && sum > 0.0 {
                of_vertex.iter_mut().for_each(|(_, weight)| *weight /= sum);
            } else {
                *of_vertex = vec![(0, 1.0)];
            }
        }
        Ok(Some(Self(of_vertex)))
    }

    /// The vertices in the world.
    pub fn bend(&self, joints: &Joints, positions: &[DVec3]) -> Vec<DVec3> {
        let matrices: Vec<DAffine3> =
            joints.rest.iter().zip(&joints.inverse).map(|(rest, inverse)| *rest * *inverse).collect();
        let place = |(p, of_vertex): (&DVec3, &Vec<(usize, f64)>)| {
            of_vertex.iter().map(|&(joint, weight)| matrices[joint].transform_point3(*p) * weight).sum()
        };
        positions.iter().zip(&self.0).map(place).collect()
    }

    /// Bounds of all positions of vertices; each vertex may be anywhere in its box.
    pub fn sweep(
        &self,
        document: &Document,
        motion: &Motion,
        joints: &Joints,
        vertices: &[[DVec3; 2]],
        root: DAffine3,
    ) -> Result<Aabb, ImportError> {
        let mut of_joint = vec![Aabb::EMPTY; joints.nodes.len()];
        for ([min, max], of_vertex) in vertices.iter().zip(&self.0) {
            for &(joint, _) in of_vertex {
                let inverse = joints.inverse[joint];
                let points = if min == max { vec![*min] } else { corners(Aabb { min: *min, max: *max }).to_vec() };
                let all = &mut of_joint[joint];
                *all = points.iter().fold(*all, |b, &p| b.with(inverse.transform_point3(p)));
            }
        }
        let mut swept = Aabb::EMPTY;
        for (&node, bounds) in joints.nodes.iter().zip(of_joint).filter(|(_, bounds)| !bounds.is_empty()) {
            swept = swept.union(motion.sweep(document, node, &corners(bounds), root)?);
        }
        Ok(swept)
    }
}
