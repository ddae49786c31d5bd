//! Finds products that the reader would need minutes and gigabytes for: disks swept along curves with too many parts.

use super::tubes::MOST_SECTIONS;
use ifc_lite_core::{DecodedEntity, EntityDecoder, IfcType};

/// Limit of records per product. Fewer: curves after many other records are missed. More: long lists take twice the time.
const MOST_RECORDS: usize = 1 << 14;

/// Whether a product has such a disk, also in a map or a boolean.
pub(super) fn has_endless_curve(product: &DecodedEntity, decoder: &mut EntityDecoder<'_>) -> bool {
    let mut left: Vec<u32> = product.get_ref(6).into_iter().collect();
    let mut records = 0..MOST_RECORDS;
    while let (Some(id), Some(_)) = (left.pop(), records.next()) {
        let Ok(record) = decoder.decode_by_id(id) else { continue };
        match record.ifc_type {
            IfcType::IfcProductDefinitionShape => left.extend(record.get_refs(2).unwrap_or_default()),
            IfcType::IfcShapeRepresentation => left.extend(record.get_refs(3).unwrap_or_default()),
            IfcType::IfcMappedItem => left.extend(record.get_ref(0)),
            IfcType::IfcRepresentationMap => left.extend(record.get_ref(1)),
            IfcType::IfcBooleanResult | IfcType::IfcBooleanClippingResult => {
                left.extend([1, 2].into_iter().filter_map(|slot| record.get_ref(slot)));
            }
            IfcType::IfcSweptDiskSolid if is_endless(&record, decoder) => return true,
            _ => {}
        }
    }
    false
}

/// Whether a swept disk's curve has more parts than a product may have sections.
fn is_endless(disk: &DecodedEntity, decoder: &mut EntityDecoder<'_>) -> bool {
    let mut of = |record: &DecodedEntity| record.get_ref(0).and_then(|id| decoder.decode_by_id(id).ok());
    let Some(curve) = of(disk) else { return false };
    let count = |record: &DecodedEntity, slot| record.get_list(slot).map(<[_]>::len);
    let parts = match curve.ifc_type {
        IfcType::IfcPolyline | IfcType::IfcCompositeCurve => count(&curve, 0),
        // Without segments it is a polyline.
        IfcType::IfcIndexedPolyCurve => count(&curve, 1).or_else(|| count(&of(&curve)?, 0)),
        _ => None,
    };
    parts.is_some_and(|parts| parts > MOST_SECTIONS)
}
