//! What a document leaves open and only the volume can decide; the choice is stated in the document, so that a picture's metadata tell
//! it, and a later version of Tyndall that would choose otherwise still gives the same picture.

use crate::document::Document;
use tyndall::volume::Volume;

/// What gradients in CT are measured against, in Hounsfield units: from air to dense bone, about as wide as the robust range of a scan
/// without metal. A constant, so that metal, padding or another field of view change no surface of a follow-up scan.
const CT_GRADIENT_RANGE: f32 = 2600.0;

/// States in a document what it leaves open.
pub(crate) fn state(document: &mut Document, volume: &Volume) {
    let by_kind = || if volume.is_ct() { Some(CT_GRADIENT_RANGE) } else { robust_range(volume) };
    document.medium.gradient_range = document.medium.gradient_range.or_else(by_kind);
}

/// The width of the robust range, against which versions that did not state it measured all gradients; `None` for data of a single value.
pub(crate) fn robust_range(volume: &Volume) -> Option<f32> {
    Some(volume.robust_width()).filter(|&width| width > 0.0)
}
