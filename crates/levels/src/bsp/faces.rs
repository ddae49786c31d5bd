//! The faces of a level whose faces are chains of edges: reads and checks them.

use super::error::{BspError, entry, lump as fault};
use super::file::LevelFile;
use super::layout::{Face as FaceRecord, Lump, Texture};
use super::record::{POINT, Records, i32};
use crate::FARTHEST;
use glam::DVec3;

/// A convex face.
pub(crate) struct Face {
    /// Indices of vertices, counter-clockwise from the visible side.
    pub corners: Vec<u32>,
    /// Index of its texture info.
    pub texture: usize,
}

/// How a texture lies on faces: a texel is at `axes[k] . p + offsets[k]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    pub axes: [DVec3; 2],
    pub offsets: [f64; 2],
    /// Width and height of the texture, texels.
    pub size: [f64; 2],
}

/// The faces of a level.
pub(crate) struct Faces {
    pub vertices: Vec<DVec3>,
    pub faces: Vec<Face>,
    /// By texture info: its texture's name in lower case; of sky, with `sky` before it.
    pub textures: Vec<String>,
    /// By texture info: the surface's flags, in games that have them.
    pub flags: Vec<i64>,
    /// By texture info.
    pub projections: Vec<Projection>,
}

/// Bytes of a name in a texture info.
const LONG_NAME: usize = 32;
/// Flags of surfaces in Quake 2: sky; liquids and translucent ones; those that are not drawn, hints among them.
const SKY: i64 = 0x4;
pub(crate) const SEE_THROUGH: i64 = 0x8 | 0x10 | 0x20;
pub(crate) const UNDRAWN: i64 = 0x80 | 0x100 | 0x200;

/// Width and height of a missing texture, texels.
const USUAL_SIZE: u32 = 64;

/// How this game's faces are written.
fn record(file: &LevelFile) -> Result<FaceRecord, BspError> {
    file.layout.face.ok_or_else(|| {
        fault(Lump::Faces, "has faces of a kind that isn't read: `vis` takes this game's levels, `bake` does not")
    })
}

impl Faces {
    /// The faces of all models.
    pub fn read(file: &LevelFile) -> Result<Self, BspError> {
        let record = record(file)?;
        let [vertices, edges, surface_edges, infos, faces] =
            [Lump::Vertices, Lump::Edges, Lump::SurfaceEdges, Lump::TextureInfos, Lump::Faces].map(|lump| file.lump(lump));
        let (vertices, edges, surface_edges, infos, faces) = (vertices?, edges?, surface_edges?, infos?, faces?);
        let vertices = file.records(Lump::Vertices, &vertices, POINT)?;
        let edges = file.records(Lump::Edges, &edges, 2 * record.ends[0].size())?;
        let surface_edges = file.records(Lump::SurfaceEdges, &surface_edges, 4)?;
        let infos = file.records(Lump::TextureInfos, &infos, record.info)?;
        let faces = file.records(Lump::Faces, &faces, record.size)?;

        let vertices: Vec<DVec3> = (0..vertices.len()).map(|v| vertices.point(v, 0)).collect();
        let is_near = |p: &DVec3| p.abs().cmple(DVec3::splat(FARTHEST)).all();
        if let Some(i) = vertices.iter().position(|p| !is_near(p)) {
            return Err(entry(Lump::Vertices, i, format!("is not within {FARTHEST:e} of the origin")));
        }
        let Infos { names: textures, flags, projections } = textures(file, &infos, &record)?;
        let corner = |face: usize, at: usize| -> Result<u32, BspError> {
            let missing = |what: String| entry(Lump::Faces, face, what);
            if at >= surface_edges.len() {
                return Err(missing(format!("its surface edge {at} doesn't exist")));
            }
            let edge = surface_edges.int(at, i32(0));
            let index = edge.unsigned_abs() as usize;
            if index >= edges.len() {
                return Err(missing(format!("its edge {index} doesn't exist")));
            }
            let vertex = edges.index(index, record.ends[usize::from(edge < 0)]);
            if vertex < vertices.len() {
                Ok(vertex as u32)
            } else {
                Err(missing(format!("its vertex {vertex} doesn't exist")))
            }
        };
        let (mut all, mut corners_of_all) = (Vec::new(), 0usize);
        for i in 0..faces.len() {
            let [first, count] = record.edges.map(|field| faces.index(i, field));
            let texture = faces.index(i, record.texture_info);
            if texture >= textures.len() {
                return Err(entry(Lump::Faces, i, format!("its texture info {texture} doesn't exist")));
            }
            corners_of_all = corners_of_all.saturating_add(count);
            if corners_of_all > surface_edges.len() {
                let what = format!("ends beyond the {} surface edges; each belongs to one face", surface_edges.len());
                return Err(entry(Lump::Faces, i, what));
            }
            // The file has them clockwise.
            let corners =
                (first..first.saturating_add(count)).rev().map(|at| corner(i, at)).collect::<Result<Vec<_>, _>>()?;
            all.push(Face { corners, texture });
        }
        Ok(Self { vertices, faces: all, textures, flags, projections })
    }
}

/// By texture info.
#[derive(Default)]
struct Infos {
    names: Vec<String>,
    flags: Vec<i64>,
    projections: Vec<Projection>,
}

/// Names, flags and projections.
fn textures(file: &LevelFile, infos: &Records<'_>, record: &FaceRecord) -> Result<Infos, BspError> {
    let lump = file.lump(Lump::Textures)?;
    let mut all = Infos::default();
    for i in 0..infos.len() {
        let (name, flags, size) = match record.texture {
            Texture::Named { name, flags } => {
                let flags = infos.int(i, flags);
                let name = text(&infos.record(i)[name..name + LONG_NAME]);
                (if flags & SKY != 0 { format!("sky {name}") } else { name }, flags, None)
            }
            Texture::Number(field) => {
                let texture = infos.index(i, field);
                let count = lump.first_chunk().map_or(0, |&b| u32::from_le_bytes(b)) as usize;
                if texture >= count {
                    return Err(entry(Lump::TextureInfos, i, format!("its texture {texture} doesn't exist")));
                }
                // A file without textures has no names, either.
                let name = texture_name(&lump, texture).unwrap_or_else(|| format!("texture {texture}"));
                (name, 0, texture_size(&lump, texture))
            }
        };
        all.names.push(name);
        all.flags.push(flags);
        all.projections.push(Projection {
            axes: [infos.point(i, 0), infos.point(i, 16)],
            offsets: [infos.float(i, 12), infos.float(i, 28)],
            size: size.unwrap_or([USUAL_SIZE; 2]).map(f64::from),
        });
    }
    Ok(all)
}

/// Visits the faces of each leaf, leaf by leaf; `faces` is their number.
pub(crate) fn marked_faces(file: &LevelFile, faces: usize, mut visit: impl FnMut(usize, usize)) -> Result<(), BspError> {
    let mark = record(file)?.mark;
    let (leaves, marks) = (file.lump(Lump::Leaves)?, file.lump(Lump::MarkSurfaces)?);
    let record = file.of_version(Lump::Leaves, file.layout.leaves)?;
    let leaves = file.records(Lump::Leaves, &leaves, record.size)?;
    let marks = file.records(Lump::MarkSurfaces, &marks, mark.size())?;
    let mut all = 0usize;
    for leaf in 0..leaves.len() {
        let [from, count] = record.marks.map(|field| leaves.index(leaf, field));
        all = all.saturating_add(count);
        let end = from.saturating_add(count);
        if end > marks.len() || all > marks.len() {
            return Err(entry(Lump::Leaves, leaf, format!("its mark surfaces go beyond the {} of the file", marks.len())));
        }
        for at in from..end {
            let face = marks.index(at, mark);
            if face >= faces {
                return Err(entry(Lump::Leaves, leaf, format!("its face {face} doesn't exist")));
            }
            visit(leaf, face);
        }
    }
    Ok(())
}

/// Bytes of a texture's name, at the start of its entry.
pub(crate) const NAME: usize = 16;

/// A texture's name in lower case; `None` if it is missing. `lump`: [`Lump::Textures`].
pub(crate) fn texture_name(lump: &[u8], texture: usize) -> Option<String> {
    let entry = texture_entry(lump, texture)?;
    Some(text(&entry[..entry.len().min(NAME)]))
}

/// Letters up to a zero byte, in lower case.
fn text(bytes: &[u8]) -> String {
    bytes.iter().take_while(|&&b| b != 0).map(|&b| char::from(b.to_ascii_lowercase())).collect()
}

/// A texture's width and height, texels; `None` if it is missing or has no texels.
fn texture_size(lump: &[u8], texture: usize) -> Option<[u32; 2]> {
    let entry = texture_entry(lump, texture)?;
    let size = [word(entry, NAME)?, word(entry, NAME + 4)?];
    (!size.contains(&0)).then_some(size)
}

/// The lump of textures from the start of one of them.
pub(crate) fn texture_entry(lump: &[u8], texture: usize) -> Option<&[u8]> {
    let count = word(lump, 0)? as usize;
    let offset = word(lump, texture.checked_mul(4)?.checked_add(4)?).filter(|_| texture < count)?;
    lump.get(offset as usize..)
}

/// The number in four bytes.
pub(crate) fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at.checked_add(4)?).map(|b| b.iter().rev().fold(0u32, |n, &b| n << 8 | u32::from(b)))
}
