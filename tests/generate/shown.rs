//! A generated file as another reader sees it.

use enfilade_scenes::Generated;
use glam::{DMat4, DVec3};

/// A node of a file that shows a mesh.
pub struct Placed {
    pub name: String,
    pub world: DMat4,
    pub mesh: usize,
    /// Names of the nodes above, from the root.
    pub above: Vec<String>,
}

/// A file as another reader sees it.
pub struct Shown {
    pub nodes: Vec<Placed>,
    /// Positions and number of triangles by mesh.
    pub meshes: Vec<(Vec<DVec3>, usize)>,
}

impl Shown {
    pub fn of(made: &Generated) -> Self {
        let file = gltf::Gltf::from_slice(&made.glb).unwrap();
        let meshes = file
            .meshes()
            .map(|mesh| {
                let part = mesh.primitives().next().unwrap();
                let positions = part.reader(|_| file.blob.as_deref()).read_positions().unwrap();
                (positions.map(|p| DVec3::from(p.map(f64::from))).collect(), part.indices().unwrap().count() / 3)
            })
            .collect();
        let mut nodes = Vec::new();
        let mut left: Vec<_> = (file.default_scene().unwrap().nodes()).map(|n| (n, DMat4::IDENTITY, Vec::new())).collect();
        while let Some((node, mut world, mut above)) = left.pop() {
            world *= DMat4::from_cols_array_2d(&node.transform().matrix().map(|column| column.map(f64::from)));
            let name = node.name().unwrap().to_owned();
            if let Some(mesh) = node.mesh() {
                nodes.push(Placed { name: name.clone(), world, mesh: mesh.index(), above: above.clone() });
            }
            above.push(name);
            left.extend(node.children().map(|child| (child, world, above.clone())));
        }
        Self { nodes, meshes }
    }

    pub fn triangles(&self) -> usize {
        self.nodes.iter().map(|n| self.meshes[n.mesh].1).sum()
    }

    pub fn corners<'s>(&'s self, node: &'s Placed) -> impl Iterator<Item = DVec3> + 's {
        self.meshes[node.mesh].0.iter().map(|&p| node.world.transform_point3(p))
    }
}
