//! Roles of products for the partition into cells.

use enfilade::scene::Role;
use ifc_lite_core::IfcType;

/// The role of an element; `None` for products without building geometry: openings, spaces, annotations, grids, virtual elements,
/// ports, structural analysis.
pub(super) fn role(kind: &IfcType) -> Option<Role> {
    use IfcType as T;
    let is = |kinds: &[T]| kinds.iter().any(|k| kind.is_subtype_of(k.clone()));
    if is(&[T::IfcDoor]) {
        Some(Role::Door)
    } else if is(&[T::IfcWindow]) {
        Some(Role::Window)
    } else if is(&[T::IfcSite, T::IfcBuilding]) {
        // Terrain, which some exporters attach to the building.
        Some(Role::Structure)
    } else if is(&[
        T::IfcFeatureElementSubtraction,
        T::IfcSpatialElement,
        T::IfcVirtualElement,
        T::IfcAnnotation,
        T::IfcPositioningElement,
        T::IfcPort,
        T::IfcStructuralItem,
        T::IfcStructuralActivity,
        T::IfcGrid,
    ]) {
        None
    } else if is(&[T::IfcBuildingElementPart]) {
        // The layers of walls and slabs; in IFC4 they are components, like bolts.
        Some(Role::Structure)
    } else if is(&[T::IfcStair, T::IfcStairFlight]) {
        Some(Role::Stair)
    } else if is(&[
        T::IfcRailing,
        T::IfcShadingDevice,
        T::IfcFurnishingElement,
        T::IfcDistributionElement,
        T::IfcTransportElement,
        T::IfcElementComponent,
        T::IfcElectricalElement,
        T::IfcEquipmentElement,
    ]) {
        Some(Role::Furnishing)
    } else if is(&[
        // Walls, slabs, roofs, ramps, columns, beams, plates, coverings, footings, and proxies. A proxy may be anything:
        // furniture as a wall adds a cell, but a wall as furniture loses a room's boundary.
        T::IfcBuiltElement,
        T::IfcBuildingElement,
        T::IfcFeatureElementAddition,
        T::IfcGeographicElement,
        T::IfcCivilElement,
    ]) {
        Some(Role::Structure)
    } else {
        Some(Role::Unknown)
    }
}

/// Whether see-through parts of an element are panes, unlike the glass top of a table.
pub(super) fn holds_panes(kind: &IfcType) -> bool {
    [IfcType::IfcPlate, IfcType::IfcCurtainWall, IfcType::IfcMember].into_iter().any(|k| kind.is_subtype_of(k))
}

/// Whether it is a wall of any kind.
pub(super) fn is_wall(kind: &IfcType) -> bool {
    [IfcType::IfcWall, IfcType::IfcCurtainWall].into_iter().any(|k| kind.is_subtype_of(k))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_of_both_schemas_have_the_role_that_people_expect() {
        let of = |keyword: &str| role(&ifc_lite_core::ifc_type_from_keyword(keyword));
        for keyword in ["IFCWALL", "IFCWALLSTANDARDCASE", "IFCSLAB", "IFCROOF", "IFCRAMP", "IFCCOLUMN"] {
            assert_eq!(of(keyword), Some(Role::Structure), "{keyword}");
        }
        for keyword in ["IFCCURTAINWALL", "IFCPLATE", "IFCCOVERING", "IFCFOOTING", "IFCBUILDINGELEMENTPROXY", "IFCSITE"] {
            assert_eq!(of(keyword), Some(Role::Structure), "{keyword}");
        }
        for keyword in ["IFCFURNITURE", "IFCFURNISHINGELEMENT", "IFCFLOWTERMINAL", "IFCRAILING", "IFCLIGHTFIXTURE"] {
            assert_eq!(of(keyword), Some(Role::Furnishing), "{keyword}");
        }
        assert_eq!([of("IFCSTAIR"), of("IFCSTAIRFLIGHT")], [Some(Role::Stair); 2]);
        assert_eq!(of("IFCDOORSTANDARDCASE"), Some(Role::Door));
        assert_eq!(of("IfcWindow"), Some(Role::Window));
        for keyword in ["IFCOPENINGELEMENT", "IFCSPACE", "IFCANNOTATION", "IFCGRID", "IFCVIRTUALELEMENT", "IFCSPATIALZONE"] {
            assert_eq!(of(keyword), None, "{keyword}");
        }
    }
}
