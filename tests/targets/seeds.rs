//! Small files that the targets accept, written here and by the project's other tests.

use serde_json::{Value, json};
use testing::boxes::flat;
use testing::forge::{Shape, random_file, sample};
use testing::games::{self, GAMES, Game};
use testing::glb::base64;
use testing::prt_texts::{HALF_LIFE, HALF_LIFE_BARE, PRT1, PRT1_AM, PRT2, QUAKE3};
use testing::quake::{AIR, Layout, bsp as level, three_rooms};

/// Cells of the level that rows are read for.
pub const ROWS: usize = 4;

pub fn pvs() -> Vec<Vec<u8>> {
    let small = Shape { cells: 4, portals: 3, objects: 33, keep_bounds: true };
    let random =
        [(7, small), (8, Shape { keep_bounds: false, ..small })].map(|(seed, shape)| random_file(seed, shape).write());
    [vec![sample().write(), flat().0.finish().1.write()], random.to_vec()].concat()
}

/// Lines of every kind, with what makes no tube beside them.
pub fn geojson() -> Vec<Vec<u8>> {
    let main = |id: Value, properties: Value, geometry: Value| json!({"type": "Feature", "id": id, "properties": properties, "geometry": geometry});
    let line = json!({"type": "LineString", "coordinates": [[500.0, 0.0], [510.0, 0.0, 2.0], [510.0, 5.0, 2.0]]});
    let lines = json!({"type": "MultiLineString", "coordinates": [[[0, 500], [0, 510]], [[1, 500], [1, 510], [1, 505]]]});
    let both = json!({"type": "GeometryCollection", "geometries": [{"type": "Point", "coordinates": [0, 0]}, lines]});
    let features = json!({
        "type": "FeatureCollection", "crs": {"type": "name", "properties": {"name": "EPSG:32618"}},
        "features": [
            main(json!("a"), json!({"radius": 0.5}), line.clone()),
            main(json!(7), json!({"diameter": 0.25, "name": "b"}), both),
            main(Value::Null, Value::Null, Value::Null)
        ]
    });
    let alone = main(json!("c"), json!({"radius": 1e-3}), line);
    [features, alone].iter().map(|file| file.to_string().into_bytes()).collect()
}

/// A triangle, indexed, in a room with a portal: as a document with its buffer in it, and as `.glb`.
pub fn gltf() -> Vec<Vec<u8>> {
    let positions: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 3.];
    let mut buffer: Vec<u8> = positions.iter().flat_map(|x| x.to_le_bytes()).collect();
    buffer.extend([0u16, 1, 2, 1, 3, 2].iter().flat_map(|i| i.to_le_bytes()));
    let document = |buffer: Value| {
        json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [
                {"name": "a-room", "mesh": 0, "children": [1, 2], "translation": [1, 2, 3]},
                {"name": "b-portal", "mesh": 0, "rotation": [0, 0, 0, 1]},
                {"name": "c", "mesh": 0, "scale": [2, 1, 1], "extras": {"enfilade": {"role": "door"}}}
            ],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
            "materials": [{"alphaMode": "OPAQUE"}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
            ],
            "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
            "buffers": [buffer]
        })
        .to_string()
    };
    let within = document(json!({"byteLength": 60, "uri": format!("data:;base64,{}", base64(&buffer))}));
    let mut text = document(json!({"byteLength": 60})).into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |n: usize| (n as u32).to_le_bytes();
    let length = 12 + 8 + text.len() + 8 + buffer.len();
    let head = [b"glTF".as_slice(), &word(2), &word(length), &word(text.len()), b"JSON", &text].concat();
    vec![within.into_bytes(), [head.as_slice(), &word(buffer.len()), b"BIN\0", &buffer].concat()]
}

pub fn obj() -> Vec<Vec<u8>> {
    let text = "mtllib a.mtl\no one\ng left\nusemtl red\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n\
                f 1/1/1 2/1/1 3/1/1 4/1/1\no two\nv 5 5 5.5e0 1.0\nf -1 -2 \\\n -5 # done\nf 1//1 3//1 5//1\n";
    vec![text.as_bytes().to_vec()]
}

/// Two rooms side by side with a door between them.
pub fn indoorgml() -> Vec<Vec<u8>> {
    let ring = |corners: &[[f64; 3]]| {
        let pos: String = corners.iter().chain(&corners[..1]).map(|p| format!("{} {} {} ", p[0], p[1], p[2])).collect();
        format!("<g:Polygon><g:exterior><g:LinearRing><g:posList>{pos}</g:posList></g:LinearRing></g:exterior></g:Polygon>")
    };
    let space = |id: &str, x: f64| {
        let c = |i: usize| [x + 4.0 * (i & 1) as f64, 5.0 * (i >> 1 & 1) as f64, 3.0 * (i >> 2) as f64];
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let members: String = sides.map(|s| format!("<g:surfaceMember>{}</g:surfaceMember>", ring(&s.map(c)))).concat();
        format!(
            r##"<c:cellSpaceMember><c:CellSpace g:id="{id}"><c:cellSpaceGeometry><c:Geometry3D><g:Solid><g:exterior><g:Shell>{members}
</g:Shell></g:exterior></g:Solid></c:Geometry3D></c:cellSpaceGeometry><c:duality x:href="#S-{id}"/></c:CellSpace></c:cellSpaceMember>"##
        )
    };
    let state = |id: &str| format!(r#"<c:stateMember><c:State g:id="S-{id}"/></c:stateMember>"#);
    let text = format!(
        r##"<c:IndoorFeatures xmlns:c="http://www.opengis.net/indoorgml/1.0/core" xmlns:g="http://www.opengis.net/gml/3.2"
xmlns:x="http://www.w3.org/1999/xlink"><c:primalSpaceFeatures><c:PrimalSpaceFeatures>{}{}</c:PrimalSpaceFeatures></c:primalSpaceFeatures>
<c:multiLayeredGraph><c:SpaceLayer>{}{}<c:transitionMember><c:Transition g:id="T"><c:connects x:href="#S-A"/><c:connects x:href="#S-B"/>
</c:Transition></c:transitionMember></c:SpaceLayer></c:multiLayeredGraph></c:IndoorFeatures>"##,
        space("A", 0.0),
        space("B", 4.0),
        state("A"),
        state("B")
    );
    vec![text.into_bytes()]
}

pub fn prt() -> Vec<Vec<u8>> {
    [PRT1, PRT2, PRT1_AM, HALF_LIFE, HALF_LIFE_BARE, QUAKE3].map(|t| t.as_bytes().to_vec()).to_vec()
}

pub fn rows() -> Vec<Vec<u8>> {
    vec![b"0 3: 0 1 2\n1 4: 0 1 2 3\n2 2: 1 2\n3 2: 1 3\n".to_vec()]
}

pub fn path() -> Vec<Vec<u8>> {
    let frame = |eye: [f64; 3], target: [f64; 3]| json!({"eye": eye, "target": target});
    let frames = [frame([1.5, 1.6, 2.0], [1.5, 1.6, 9.0]), frame([-3.0, 1.5, 2.0], [8.5, 1.0, 1.0])];
    vec![json!({"name": "p", "fov_y_degrees": 60, "near": 0.05, "frames": frames}).to_string().into_bytes()]
}

/// The cells of [`flat`].
pub fn cells() -> Vec<Vec<u8>> {
    let corridor: Vec<Value> =
        [[-1, 0, 0, 0], [1, 0, 0, 10], [0, -1, 0, 0], [0, 1, 0, 3], [0, 0, -1, -4], [0, 0, 1, 6]].map(Value::from).to_vec();
    let door = |x: f64| json!([[x, 0, 4], [x, 2.1, 4], [x + 1.0, 2.1, 4], [x + 1.0, 0, 4]]);
    let file = json!({
        "cells": [
            {"id": 0, "name": "A", "min": [0, 0, 0], "max": [4, 3, 4]},
            {"id": 1, "min": [6, 0, 0], "max": [10, 3, 4], "source": "b"},
            {"id": 2, "pieces": [{"planes": corridor}], "open": true}
        ],
        "portals": [
            {"id": 0, "cells": [0, 2], "kind": "door", "winding": door(1.0), "state": {"shut": true}},
            {"id": 1, "cells": [1, 2], "winding": door(8.0)}
        ]
    });
    vec![file.to_string().into_bytes()]
}

pub fn view_cells() -> Vec<Vec<u8>> {
    let file = json!({"cells": [
        {"id": "lobby", "min": [0, 1, 0], "max": [4, 2, 3]},
        {"id": 7, "pieces": [{"planes": [[-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0], [1, 1, 1, 3]]}]}
    ]});
    vec![file.to_string().into_bytes()]
}

pub fn rooms() -> Vec<Vec<u8>> {
    let solid =
        json!({"v": [[6, 0, 0], [10, 0, 0], [6, 3, 0], [6, 0, 4]], "t": [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]});
    let footprint = |x: f64| json!([[[[x, 0], [x + 4.0, 0], [x + 4.0, 4], [x, 4]]]]);
    let file = json!({
        "rooms": [
            {"id": "a", "name": "A", "floor_y": 0, "ceiling_y": 3, "footprint": footprint(0.0)},
            {"id": "b", "floor_y": 0, "ceiling_y": 3, "footprint": footprint(6.0), "covered": 1.0, "solid": solid}
        ],
        "doors": [{"id": "d", "kind": "door", "centre": [1.5, 1, 4], "rooms": ["a", null]}],
        "voids": [{"kind": "slab_opening", "bbox": [0, 0, 0, 1, 1, 1]}]
    });
    vec![file.to_string().into_bytes()]
}

/// Five cells in a row with doors out of line, and a portal that is anything.
pub fn graph() -> Vec<Vec<u8>> {
    let mut row = vec![3u8];
    for k in 0..4u8 {
        // Cells k and k + 1, across x: where, a corner, a size.
        row.extend([k, 0, 0, 130 + 16 * k, 0, 120, 110 + 8 * k, 0, 136, 130]);
    }
    let mut odd = row.clone();
    odd.extend([4, 1, 131, 120, 120, 120, 120, 120, 120, 130, 240, 120, 120, 140, 241]);
    vec![row, odd]
}

/// Strips and tiles, as they are and packed in each way, both orders of bytes, both widths of places.
pub fn tiff() -> Vec<Vec<u8>> {
    use testing::tiffs::Tiff;
    let plain = Tiff::wholes([5, 4], &[3; 20]);
    let packed = Tiff { tile: Some([16, 16]), packed: true, predictor: 2, big: true, ..Tiff::wholes([20, 17], &[7; 340]) };
    let tags = vec![(42113, 2, b"3\0".to_vec())];
    let rising: [f32; 340] = std::array::from_fn(|k| 1.5 * k as f32);
    let floats = Tiff { packed: true, predictor: 3, large: true, ..Tiff::floats([20, 17], &rising) };
    let lzw =
        Tiff { lzw: true, predictor: 2, ..Tiff::wholes([20, 17], &std::array::from_fn::<i16, 340, _>(|k| (k * k) as i16)) };
    let absent = Tiff { tags, ..Tiff::wholes([3, 3], &[2; 9]) };
    [plain, packed, absent, floats, lzw].iter().map(Tiff::bytes).collect()
}

/// In levels; whole, with a void; and of one tile that is hardly used.
pub fn ground() -> Vec<Vec<u8>> {
    use testing::ground_file::{GroundFile, hills};
    let mut whole = GroundFile::by_hand([40, 37], 33, false, |c, r| if c + r == 9 { 0xffff } else { (c * r) as u16 });
    let mut least = GroundFile::by_hand([2, 3], 33, false, |c, r| (c + r) as u16);
    [&mut whole, &mut least].into_iter().for_each(GroundFile::sign);
    vec![hills().bytes(), whole.bytes(), least.bytes()]
}

/// A square of nine samples, one of them void.
pub fn hgt() -> Vec<Vec<u8>> {
    vec![[1i16, 2, 3, 4, -32768, 6, 7, 8, 9].iter().flat_map(|h| h.to_be_bytes()).collect()]
}

pub fn asc() -> Vec<Vec<u8>> {
    let text =
        "ncols 3\nnrows 2\nxllcorner 500000.0\nyllcorner 5300000\ncellsize 30\nNODATA_value -9999\n1 2 3\n4.5 -9999 6\n";
    vec![text.as_bytes().to_vec()]
}

pub fn bsp() -> Vec<Vec<u8>> {
    let of_quake = [false, true].map(|bsp2| level(&three_rooms(AIR), Layout { bsp2, ..Layout::default() }));
    let drawn = [Game::Quake2, Game::Qbism, Game::Quake3, Game::Source(20), Game::Source(25), Game::Console]
        .map(games::drawn::sample);
    of_quake.into_iter().chain(GAMES.map(games::level)).chain(drawn).collect()
}

pub fn map() -> Vec<Vec<u8>> {
    use testing::map::{block, entity, start, two_rooms};
    let door = entity("func_door", "", &[block([128, 32, 0], [136, 96, 64], "wood")]);
    let water = entity("func_group", "", &[block([200, 0, 0], [264, 128, 16], "*water")]);
    vec![(entity("worldspawn", "", &two_rooms()) + &door + &water + &start("64 64 24")).into_bytes()]
}

#[cfg(feature = "ifc")]
pub fn ifc() -> Vec<Vec<u8>> {
    vec![testing::house::House::default().text().into_bytes()]
}
