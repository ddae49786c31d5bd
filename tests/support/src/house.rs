//! A house in IFC of which every number is known.
//!
//! In its own axes (metres, +Z up): a wall from (0, -0.1, 0) to (6, 0.1, 3) with a door at x 1..2, z 0..2.1, an empty hole at
//! x 2.5..3.5, z 0..2, and a window at x 4..5, z 1..2; a kitchen from (0, 0.1, 0) to (6, 3.1, 2.5) whose far side is open
//! towards a yard (0, 3.1, 0) to (6, 6.1, 2.5); a chair; a pane of glass on y 3.1..3.15, x 5..6, z 0..2.

use enfilade::scene::{Role, Scene};
use glam::{DVec2, DVec3};
use std::fmt::Write;

/// The schema to write.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Schema {
    Ifc2x3,
    Ifc4,
}

impl Schema {
    pub fn name(self) -> &'static str {
        match self {
            Self::Ifc2x3 => "IFC2X3",
            Self::Ifc4 => "IFC4",
        }
    }
}

/// How to write it.
#[derive(Clone, Copy, Debug)]
pub struct House {
    pub schema: Schema,
    pub units_per_metre: f64,
    /// Turned about the vertical, counter-clockwise from above.
    pub degrees: f64,
    /// Where the site's origin is, metres, +Z up.
    pub offset: DVec3,
    /// Height of the storey above the site, metres.
    pub storey: f64,
}

impl Default for House {
    fn default() -> Self {
        Self { schema: Schema::Ifc2x3, units_per_metre: 1.0, degrees: 0.0, offset: DVec3::ZERO, storey: 0.5 }
    }
}

impl House {
    /// From the house's axes to the model's: metres, +Y up.
    pub fn at(&self, p: DVec3) -> DVec3 {
        let plan = DVec2::from_angle(self.degrees.to_radians()).rotate(DVec2::new(p.x, p.y));
        let p = self.offset + DVec3::new(plan.x, plan.y, p.z + self.storey);
        DVec3::new(p.x, p.z, -p.y)
    }

    /// The file.
    #[expect(clippy::too_many_lines, reason = "one text")]
    pub fn text(&self) -> String {
        let u = |metres: f64| format!("{:?}", metres * self.units_per_metre);
        let turn = DVec2::from_angle(self.degrees.to_radians());
        let mut t = format!(
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('house.ifc','',(''),(''),'','','');\n\
             FILE_SCHEMA(('{}'));\nENDSEC;\nDATA;\n",
            self.schema.name()
        );
        let prefix = if self.units_per_metre == 1000.0 { ".MILLI." } else { "$" };
        let o = self.offset;
        let _ = write!(
            t,
            "#1=IFCPROJECT('project',$,'House',$,$,$,$,(#10),#5);\n\
             #5=IFCUNITASSIGNMENT((#6,#7));\n\
             #6=IFCSIUNIT(*,.LENGTHUNIT.,{prefix},.METRE.);\n\
             #7=IFCSIUNIT(*,.PLANEANGLEUNIT.,$,.RADIAN.);\n\
             #10=IFCGEOMETRICREPRESENTATIONCONTEXT($,'Model',3,1.E-5,#11,$);\n\
             #11=IFCAXIS2PLACEMENT3D(#12,$,$);\n\
             #12=IFCCARTESIANPOINT((0.,0.,0.));\n\
             #13=IFCDIRECTION((0.,0.,1.));\n\
             #14=IFCDIRECTION((0.,1.,0.));\n\
             #15=IFCDIRECTION((1.,0.,0.));\n\
             #20=IFCBUILDING('building',$,'House',$,$,#21,$,$,.ELEMENT.,$,$,$);\n\
             #21=IFCLOCALPLACEMENT($,#22);\n\
             #22=IFCAXIS2PLACEMENT3D(#23,#13,#24);\n\
             #23=IFCCARTESIANPOINT(({},{},{}));\n\
             #24=IFCDIRECTION(({:?},{:?},0.));\n\
             #40=IFCBUILDINGSTOREY('storey',$,'Ground',$,$,#41,$,$,.ELEMENT.,{});\n\
             #41=IFCLOCALPLACEMENT(#21,#42);\n\
             #42=IFCAXIS2PLACEMENT3D(#43,$,$);\n\
             #43=IFCCARTESIANPOINT((0.,0.,{}));\n\
             #50=IFCRELAGGREGATES('agg-0',$,$,$,#1,(#20));\n\
             #51=IFCRELAGGREGATES('agg-1',$,$,$,#20,(#40));\n\
             #52=IFCRELAGGREGATES('agg-2',$,$,$,#40,(#1000,#1100));\n\
             #53=IFCRELCONTAINEDINSPATIALSTRUCTURE('in',$,$,$,(#200,#300,#500,#700,#800),#40);\n",
            u(o.x),
            u(o.y),
            u(o.z),
            turn.x,
            turn.y,
            u(self.storey),
            u(self.storey),
        );
        let tag = if self.schema == Schema::Ifc4 { ",$" } else { "" };
        let sizes =
            |w: f64, h: f64| format!(",{},{}{}", u(h), u(w), if self.schema == Schema::Ifc4 { ",$,$,$" } else { "" });
        let boxes: [(u32, String, [f64; 6]); 10] = [
            (200, "IFCWALL('wall',$,'Wall',$,$,#41,#201,$$tag)".into(), [0., 6., -0.1, 0.1, 0., 3.]),
            (300, format!("IFCDOOR('door-1',$,'Door',$,$,#41,#301,${})", sizes(1., 2.1)), [1., 2., -0.025, 0.025, 0., 2.1]),
            (400, "IFCOPENINGELEMENT('hole-1',$,'',$,$,#41,#401,$$tag)".into(), [1., 2., -0.1, 0.1, 0., 2.1]),
            (450, "IFCOPENINGELEMENT('hole-2',$,'',$,$,#41,#451,$$tag)".into(), [2.5, 3.5, -0.3, 0.3, 0., 2.]),
            (500, format!("IFCWINDOW('window-3',$,'Window',$,$,#41,#501,${})", sizes(1., 1.)), [4., 5., -0.05, 0.0, 1., 2.]),
            (600, "IFCOPENINGELEMENT('hole-3',$,'',$,$,#41,#601,$$tag)".into(), [4., 5., -0.1, 0.1, 1., 2.]),
            (700, "IFCFURNISHINGELEMENT('chair',$,'Chair',$,$,#41,#701,$)".into(), [3., 3.5, 1., 1.5, 0., 1.]),
            (800, "IFCPLATE('pane',$,'Pane',$,$,#41,#801,$$tag)".into(), [5., 6., 3.1, 3.15, 0., 2.]),
            (
                1000,
                "IFCSPACE('space-kitchen',$,'1',$,$,#41,#1001,'K\\X2\\00FC\\X0\\che',.ELEMENT.,.INTERNAL.,$)".into(),
                [0., 6., 0.1, 3.1, 0., 2.5],
            ),
            (
                1100,
                "IFCSPACE('space-yard',$,'2',$,$,#41,#1101,'Yard',.ELEMENT.,.EXTERNAL.,$)".into(),
                [0., 6., 3.1, 6.1, 0., 2.5],
            ),
        ];
        for (id, record, [x0, x1, y0, y1, z0, z1]) in boxes {
            let note = if id == 700 { ("/*chair*/", "/*chair at*/") } else { ("", "") };
            let _ = write!(
                t,
                "#{id}={};\n\
                 #{}=IFCPRODUCTDEFINITIONSHAPE($,$,(#{}));\n\
                 #{}=IFCSHAPEREPRESENTATION(#10,'Body','SweptSolid',(#{}));\n\
                 #{}=IFCEXTRUDEDAREASOLID({}#{},#{},#13,{});\n\
                 #{}=IFCRECTANGLEPROFILEDEF(.AREA.,$,#{},{},{});\n\
                 #{}=IFCAXIS2PLACEMENT2D(#{},$);\n\
                 #{}=IFCCARTESIANPOINT((0.,0.));\n\
                 #{}=IFCAXIS2PLACEMENT3D(#{},$,$);\n\
                 #{}=IFCCARTESIANPOINT(({}{},{},{}));\n",
                record.replace("$tag", tag),
                id + 1,
                id + 2,
                id + 2,
                id + 3,
                id + 3,
                note.0,
                id + 4,
                id + 7,
                u(z1 - z0),
                id + 4,
                id + 5,
                u(x1 - x0),
                u(y1 - y0),
                id + 5,
                id + 6,
                id + 6,
                id + 7,
                id + 8,
                id + 8,
                note.1,
                u((x0 + x1) / 2.),
                u((y0 + y1) / 2.),
                u(z0),
            );
        }
        // The pane is of glass: in IFC2x3 by way of an assignment.
        let style = if self.schema == Schema::Ifc4 { "#902" } else { "#901" };
        let _ = write!(
            t,
            "#900=IFCSTYLEDITEM(#803,({style}),$);\n\
             #901=IFCPRESENTATIONSTYLEASSIGNMENT((#902));\n\
             #902=IFCSURFACESTYLE('Glass',.BOTH.,(#903));\n\
             #903=IFCSURFACESTYLERENDERING(#904,0.9,$,$,$,$,$,$,.NOTDEFINED.);\n\
             #904=IFCCOLOURRGB($,0.5,0.6,0.7);\n\
             #1200=IFCRELVOIDSELEMENT('void-1',$,$,$,#200,#400);\n\
             #1201=IFCRELVOIDSELEMENT('void-2',$,$,$,#200,#450);\n\
             #1202=IFCRELVOIDSELEMENT('void-3',$,$,$,#200,#600);\n\
             #1203=IFCRELFILLSELEMENT('fill-1',$,$,$,#400,#300);\n\
             #1204=IFCRELFILLSELEMENT('fill-3',$,$,$,#600,#500);\n\
             #1210=IFCRELSPACEBOUNDARY('b-door-in',$,$,$,#1000,#300,$,.PHYSICAL.,.INTERNAL.);\n\
             #1211=IFCRELSPACEBOUNDARY('b-door-out',$,$,$,#1100,#300,$,.PHYSICAL.,.INTERNAL.);\n\
             #1212=IFCRELSPACEBOUNDARY('b-open-in',$,$,$,#1000,$,#1220,.VIRTUAL.,.INTERNAL.);\n\
             #1213=IFCRELSPACEBOUNDARY('b-open-out',$,$,$,#1100,$,#1230,.VIRTUAL.,.INTERNAL.);\n"
        );
        // The kitchen's side: a polygon in a plane whose x runs down and y west, so that axes matter.
        let _ = write!(
            t,
            "#1220=IFCCONNECTIONSURFACEGEOMETRY(#1221,$);\n\
             #1221=IFCCURVEBOUNDEDPLANE(#1222,#1225,());\n\
             #1222=IFCPLANE(#1223);\n\
             #1223=IFCAXIS2PLACEMENT3D(#1224,#14,#1226);\n\
             #1224=IFCCARTESIANPOINT(({},{},{}));\n\
             #1226=IFCDIRECTION((0.,0.,-1.));\n\
             #1225=IFCPOLYLINE((#1227,#1228,#1229,#1241,#1227));\n\
             #1227=IFCCARTESIANPOINT((0.,0.));\n\
             #1228=IFCCARTESIANPOINT(({},0.));\n\
             #1229=IFCCARTESIANPOINT(({},{}));\n\
             #1241=IFCCARTESIANPOINT((0.,{}));\n",
            u(6.),
            u(3.1),
            u(2.5),
            u(2.5),
            u(2.5),
            u(6.),
            u(6.),
        );
        // The yard's side: a line swept upwards, a metre longer at either end.
        let _ = write!(
            t,
            "#1230=IFCCONNECTIONSURFACEGEOMETRY(#1231,$);\n\
             #1231=IFCSURFACEOFLINEAREXTRUSION(#1232,#11,#13,{});\n\
             #1232=IFCARBITRARYOPENPROFILEDEF(.CURVE.,$,#1233);\n\
             #1233=IFCPOLYLINE((#1234,#1235));\n\
             #1234=IFCCARTESIANPOINT(({},{}));\n\
             #1235=IFCCARTESIANPOINT(({},{}));\n\
             ENDSEC;\nEND-ISO-10303-21;\n",
            u(2.5),
            u(7.),
            u(3.1),
            u(-1.),
            u(3.1),
        );
        t
    }
}

/// How many triangles of a role the segment from `a` to `b` crosses.
pub fn crossings(scene: &Scene, role: Role, a: DVec3, b: DVec3) -> usize {
    let cross = |[p, q, r]: [DVec3; 3]| {
        let (da, db) = ((q - p).cross(r - p).dot(a - p), (q - p).cross(r - p).dot(b - p));
        let turn = |s: DVec3, t: DVec3| (b - a).cross(s - a).dot(t - a);
        let (u, v, w) = (turn(p, q), turn(q, r), turn(r, p));
        (da > 0.0) != (db > 0.0) && ((u > 0.0) == (v > 0.0) && (v > 0.0) == (w > 0.0))
    };
    let triangles = scene.objects.iter().filter(|o| o.role == role).flat_map(|o| o.triangles.clone());
    triangles.filter(|&t| cross(scene.corners(t as usize))).count()
}
