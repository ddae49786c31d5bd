//! Pipes as tubes instead of the reader's prisms: swept disks, and circles extruded along their axis or revolved.
//!
//! The whole body of a product must qualify; other shapes, and shapes cut by a boolean or an opening, keep the reader's
//! triangles.

use super::model::{Model, y_up};
use enfilade_tubes::curve::{Arc, Piece, polyline, sharpest};
use enfilade_tubes::{Counts, Shape as Round, Tubes, usual_error};
use glam::{DMat3, DMat4, DVec3, DVec4};
use ifc_lite_core::{DecodedEntity, EntityDecoder, IfcType};
use ifc_lite_geometry::placement::{Axis1Placement, Axis2Placement};
use ifc_lite_geometry::{AnalyticCurveSegment, AnalyticStatus, GeometryRouter, extract_swept_disk};

/// Maximum nesting of maps, and maximum items of a product.
const DEPTH: usize = 8;
const MOST_ITEMS: usize = 4096;
/// Maximum sections of a product. More: a record of a few bytes fills the memory.
pub(super) const MOST_SECTIONS: usize = 1 << 16;
/// Rounding of unit vectors and scales by exporters. Larger: oblique cylinders become straight ones.
const ROUNDING: f64 = 1e-6;
/// Greatest angle between a piece and the next one that counts as smooth, radians.
const SMOOTH: f64 = 1e-3;
/// Greatest gap between them, metres.
const GAP: f64 = 1e-4;

/// A curve with its radii, in metres.
struct Pipe {
    pieces: Vec<Piece>,
    radius: f64,
    inner: f64,
}

/// Why a product with round parts stays a mesh.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Stays {
    /// It has other shapes, too.
    Mixed,
    /// Openings cut it.
    Cut,
    /// A boolean cuts it.
    Boolean,
    /// Its curve does not consist of lines and arcs that join smoothly.
    Curve,
    /// Its circles become ellipses, as in an oblique cylinder.
    Uneven,
    /// It has too many items, or its tubes too many sections.
    Large,
}

impl Stays {
    /// Text for a note, after a count.
    pub(super) fn in_words(self) -> &'static str {
        match self {
            Self::Mixed => "with other shapes",
            Self::Cut => "cut by openings",
            Self::Boolean => "in booleans",
            Self::Curve => "along curves other than lines and arcs",
            Self::Uneven => "oblique or unevenly scaled",
            Self::Large => "too large",
        }
    }
}

/// The tubes of a product whose body is all tubes; otherwise the reason, if parts of it are round.
pub(super) fn of_product(
    model: &Model,
    product: &DecodedEntity,
    decoder: &mut EntityDecoder<'_>,
    router: &GeometryRouter,
) -> Result<Tubes, Option<Stays>> {
    let mut body = Body { pipes: Vec::new(), others: 0, stays: None, left: MOST_ITEMS };
    body.collect(model, product, decoder, router).ok_or(None)?;
    if let Some(stays) = body.stays {
        return Err(Some(stays));
    }
    if body.pipes.is_empty() || body.others > 0 {
        return Err((!body.pipes.is_empty()).then_some(Stays::Mixed));
    }
    if model.voids.contains_key(&product.id) {
        return Err(Some(Stays::Cut));
    }
    let mut tubes = Tubes::default();
    body.pipes.iter().try_for_each(|pipe| pipe.append_to(&mut tubes)).map_err(Some)?;
    Ok(tubes)
}

/// The body of a product.
struct Body {
    pipes: Vec<Pipe>,
    /// Number of shapes that are not round.
    others: usize,
    /// Why a round shape is no pipe.
    stays: Option<Stays>,
    /// Items left of the limit.
    left: usize,
}

impl Body {
    /// Visits a product; `None` if its records are damaged.
    fn collect(
        &mut self,
        model: &Model,
        product: &DecodedEntity,
        decoder: &mut EntityDecoder<'_>,
        router: &GeometryRouter,
    ) -> Option<()> {
        let place = DMat4::from_cols_array(&router.resolve_scaled_placement(product, decoder).ok()?);
        let place = place * DMat4::from_scale(DVec3::splat(model.metres));
        let shape = decoder.decode_by_id(product.get_ref(6)?).ok()?;
        let mut representations = shape.get_refs(2)?;
        // Some files list one twice.
        representations.dedup();
        let mut bodies = 0;
        for representation in representations {
            let representation = decoder.decode_by_id(representation).ok()?;
            if representation.get_string(1) == Some("Body") {
                bodies += 1;
                self.items(&representation, place, decoder, DEPTH)?;
            }
        }
        self.others += usize::from(bodies > 1);
        Some(())
    }

    /// Visits the items of a representation.
    fn items(
        &mut self,
        representation: &DecodedEntity,
        place: DMat4,
        decoder: &mut EntityDecoder<'_>,
        depth: usize,
    ) -> Option<()> {
        for item in representation.get_refs(3)? {
            let Some(left) = self.left.checked_sub(1) else {
                // Beyond the limit it is unknown whether the rest are pipes.
                (self.stays, self.others) =
                    (self.stays.or((!self.pipes.is_empty()).then_some(Stays::Large)), self.others + 1);
                return Some(());
            };
            self.left = left;
            let item = decoder.decode_by_id(item).ok()?;
            if item.ifc_type == IfcType::IfcMappedItem && depth > 0 {
                let map = decoder.decode_by_id(item.get_ref(0)?).ok()?;
                let origin = frame(map.get_ref(0)?, decoder)?;
                let target = decoder.decode_by_id(item.get_ref(1)?).ok()?;
                let mapped = decoder.decode_by_id(map.get_ref(1)?).ok()?;
                self.items(&mapped, place * operator(&target, decoder)? * origin, decoder, depth - 1)?;
            } else if !is_round(&item, decoder, DEPTH) {
                self.others += 1;
            } else {
                let pipe = pipe(&item, decoder).and_then(|(pipe, own)| pipe.placed(place * own));
                match pipe {
                    Ok(pipe) => self.pipes.push(pipe),
                    Err(stays) => self.stays = self.stays.max(Some(stays)),
                }
            }
        }
        Some(())
    }
}

/// Whether an item has circular sections, also before a boolean cuts it.
fn is_round(item: &DecodedEntity, decoder: &mut EntityDecoder<'_>, depth: usize) -> bool {
    let mut of = |slot: usize| item.get_ref(slot).and_then(|id| decoder.decode_by_id(id).ok());
    match item.ifc_type {
        IfcType::IfcSweptDiskSolid => true,
        IfcType::IfcExtrudedAreaSolid | IfcType::IfcRevolvedAreaSolid => {
            let circles = [IfcType::IfcCircleProfileDef, IfcType::IfcCircleHollowProfileDef];
            of(0).is_some_and(|profile| circles.contains(&profile.ifc_type))
        }
        IfcType::IfcBooleanResult | IfcType::IfcBooleanClippingResult if depth > 0 => {
            of(1).is_some_and(|first| is_round(&first, decoder, depth - 1))
        }
        _ => false,
    }
}

/// The pipe of a round item, and its placement.
fn pipe(item: &DecodedEntity, decoder: &mut EntityDecoder<'_>) -> Result<(Pipe, DMat4), Stays> {
    match item.ifc_type {
        IfcType::IfcSweptDiskSolid => Ok((swept(item, decoder).ok_or(Stays::Curve)?, DMat4::IDENTITY)),
        IfcType::IfcExtrudedAreaSolid => extruded(item, decoder).ok_or(Stays::Uneven),
        IfcType::IfcRevolvedAreaSolid => revolved(item, decoder).ok_or(Stays::Uneven),
        _ => Err(Stays::Boolean),
    }
}

/// A swept disk along lines and arcs.
fn swept(item: &DecodedEntity, decoder: &mut EntityDecoder<'_>) -> Option<Pipe> {
    let disk = extract_swept_disk(item, decoder).ok()?;
    if disk.status != AnalyticStatus::Complete {
        return None;
    }
    let piece = |segment: &AnalyticCurveSegment| match *segment {
        AnalyticCurveSegment::Line { start, end } => Piece::Line([start, end].map(DVec3::from)),
        AnalyticCurveSegment::Arc { center, normal, x_axis, radius, start_angle, sweep_angle } => {
            let x = DVec3::from(x_axis).normalize_or_zero() * radius;
            let y = DVec3::from(normal).normalize_or_zero().cross(x);
            let (sin, cos) = start_angle.sin_cos();
            let (begin, along) = (x * cos + y * sin, y * cos - x * sin);
            let y = if sweep_angle < 0.0 { -along } else { along };
            Piece::Arc(Arc { middle: DVec3::from(center), x: begin, y, angle: sweep_angle.abs() })
        }
    };
    let pieces = disk.segments.iter().map(piece).collect();
    Some(Pipe { pieces, radius: disk.radius, inner: disk.inner_radius.unwrap_or(0.0) })
}

/// A circle extruded along its axis.
fn extruded(item: &DecodedEntity, decoder: &mut EntityDecoder<'_>) -> Option<(Pipe, DMat4)> {
    let ([radius, inner], middle) = circle(item.get_ref(0)?, decoder)?;
    let along = DVec3::from(decoder.direction3_at(item, 2).ok()??).normalize_or_zero();
    let depth = item.get_float(3).filter(|depth| depth.is_finite() && *depth > 0.0)?;
    if along.truncate().length() > ROUNDING {
        return None;
    }
    let pieces = vec![Piece::Line([middle, middle + along * depth])];
    Some((Pipe { pieces, radius, inner }, position(item, decoder)?))
}

/// A circle revolved about an axis in its plane: an elbow.
fn revolved(item: &DecodedEntity, decoder: &mut EntityDecoder<'_>) -> Option<(Pipe, DMat4)> {
    let ([radius, inner], middle) = circle(item.get_ref(0)?, decoder)?;
    let axis = decoder.decode_by_id(item.get_ref(2)?).ok()?;
    let axis = Axis1Placement::read(&axis, decoder).ok()?;
    let (at, along) = (DVec3::from(axis.location), DVec3::from(axis.axis?).normalize_or_zero());
    let angle = item.get_float(3)? * decoder.plane_angle_to_radians();
    let x = (middle - at).reject_from(along);
    let is_flat = along.z.abs() <= ROUNDING && at.z.abs() <= ROUNDING * x.length();
    let turns = angle > 0.0 && angle <= std::f64::consts::TAU;
    if !(is_flat && turns && along != DVec3::ZERO && x != DVec3::ZERO) {
        return None;
    }
    let arc = Arc { middle: middle - x, x, y: along.cross(x), angle };
    Some((Pipe { pieces: vec![Piece::Arc(arc)], radius, inner }, position(item, decoder)?))
}

/// The radii of a circular area, first the outer one, and its centre.
fn circle(profile: u32, decoder: &mut EntityDecoder<'_>) -> Option<([f64; 2], DVec3)> {
    let profile = decoder.decode_by_id(profile).ok()?;
    let radius = profile.get_float(3)?;
    let inner = match profile.ifc_type {
        IfcType::IfcCircleProfileDef => 0.0,
        IfcType::IfcCircleHollowProfileDef => radius - profile.get_float(4)?,
        _ => return None,
    };
    let middle = match profile.get_ref(2) {
        Some(place) => frame(place, decoder)?.w_axis.truncate(),
        None => DVec3::ZERO,
    };
    Some(([radius, inner], middle))
}

/// The placement of a solid; the identity if it has none.
fn position(item: &DecodedEntity, decoder: &mut EntityDecoder<'_>) -> Option<DMat4> {
    item.get_ref(1).map_or(Some(DMat4::IDENTITY), |place| frame(place, decoder))
}

fn frame(place: u32, decoder: &mut EntityDecoder<'_>) -> Option<DMat4> {
    Some(DMat4::from_cols_slice(Axis2Placement::read_id(place, decoder).ok()?.matrix().as_slice()))
}

/// The transform of a mapped item; its scale must be uniform.
fn operator(target: &DecodedEntity, decoder: &mut EntityDecoder<'_>) -> Option<DMat4> {
    if target.ifc_type != IfcType::IfcCartesianTransformationOperator3D {
        return None;
    }
    let mut axis = |slot: usize, default: DVec3| {
        let found = decoder.direction3_at(target, slot).ok()?;
        Some(found.map_or(default, |v| DVec3::from(v).normalize_or(default)))
    };
    let (x, y, z) = (axis(0, DVec3::X)?, axis(1, DVec3::Y)?, axis(4, DVec3::Z)?);
    let at = DVec3::from(decoder.point3_at(target, 2).ok()??);
    let scale = target.get_float(3).unwrap_or(1.0);
    Some(DMat4::from_cols((x * scale).extend(0.0), (y * scale).extend(0.0), (z * scale).extend(0.0), at.extend(1.0)))
}

impl Pipe {
    /// Moves it. Fails if circles would become ellipses.
    fn placed(self, place: DMat4) -> Result<Self, Stays> {
        let turn = DMat3::from_mat4(place);
        let [x, y, z] = [turn.x_axis, turn.y_axis, turn.z_axis];
        let scale = x.length();
        let is_even = [y.length(), z.length()].iter().all(|length| (length / scale - 1.0).abs() <= ROUNDING);
        let is_square = [x.dot(y), y.dot(z), z.dot(x)].iter().all(|dot| dot.abs() <= ROUNDING * scale * scale);
        if !(is_even && is_square && scale > 0.0) {
            return Err(Stays::Uneven);
        }
        let at = |p: DVec3| y_up((place * DVec4::from((p, 1.0))).truncate());
        let along = |v: DVec3| y_up(turn * v);
        let piece = |piece: Piece| match piece {
            Piece::Line(ends) => Piece::Line(ends.map(at)),
            Piece::Arc(Arc { middle, x, y, angle }) => {
                Piece::Arc(Arc { middle: at(middle), x: along(x), y: along(y), angle })
            }
        };
        let pieces = self.pieces.into_iter().map(piece).collect();
        Ok(Self { pieces, radius: self.radius * scale, inner: self.inner * scale })
    }

    /// Adds its tubes.
    fn append_to(&self, tubes: &mut Tubes) -> Result<(), Stays> {
        self.curves(tubes).ok_or(Stays::Curve)?;
        if tubes.sections.len() <= MOST_SECTIONS { Ok(()) } else { Err(Stays::Large) }
    }

    fn curves(&self, tubes: &mut Tubes) -> Option<()> {
        let round = Round { radius: self.radius, inner: self.inner, capped: true };
        let (error, mut counts) = (usual_error(self.radius), Counts::default());
        let [first, last] = [self.pieces.first()?.ends()[0], self.pieces.last()?.ends()[1]];
        let closed = first.distance(last) <= GAP;
        let is_joined = self.pieces.windows(2).all(|pair| pair[0].ends()[1].distance(pair[1].ends()[0]) <= GAP);
        if !is_joined {
            return None;
        }
        if sharpest(&self.pieces, closed) <= SMOOTH {
            tubes.curve(&self.pieces, closed, round, error, &mut counts).ok()?;
        } else {
            // Corners between lines are rounded, as in all polylines.
            let lines = self.pieces.iter().map(|piece| if let Piece::Line(ends) = piece { Some(*ends) } else { None });
            let mut points: Vec<DVec3> = lines.clone().map(|line| line.map(|ends| ends[0])).collect::<Option<_>>()?;
            points.push(last);
            let curves = polyline(&points, closed, self.radius, &mut counts.odd);
            for pieces in &curves {
                tubes.curve(pieces, closed && curves.len() == 1, round, error, &mut counts).ok()?;
            }
        }
        Some(())
    }
}
