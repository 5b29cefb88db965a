//! What a document leaves open and only the volume can decide; the choice is stated in the document, so that a picture's metadata tell
//! it, and a later version of Tyndall that would choose otherwise still gives the same picture.

use crate::document::{Document, Interpolation, TransferFunction};
use tyndall::transfer::Preset;
use tyndall::volume::Volume;

/// What gradients in CT are measured against, in Hounsfield units: from air to dense bone, about as wide as the robust range of a scan
/// without metal. A constant, so that metal, padding or another field of view change no surface of a follow-up scan.
const CT_GRADIENT_RANGE: f32 = 2600.0;

/// States in a document what it leaves open.
pub(crate) fn state(document: &mut Document, volume: &Volume) {
    let function = document.transfer_function.get_or_insert_default();
    if *function == TransferFunction::default() {
        // Whoever gives an interpolation, as all pictures of earlier versions do, sees the data as a field.
        let is_open = document.volume.interpolation.is_none();
        let preset = if is_open { Preset::for_volume(volume) } else { Preset::for_field(volume) };
        function.preset = Some(preset.name.to_owned());
    }
    let preset = function.preset.as_deref().and_then(Preset::named);
    let shows_labels = preset.is_some_and(Preset::shows_labels);
    let usual = if shows_labels { Interpolation::Nearest } else { Interpolation::Linear };
    document.volume.interpolation.get_or_insert(usual);
    let by_kind = || if volume.is_ct() { Some(CT_GRADIENT_RANGE) } else { robust_width(volume) };
    document.medium.gradient_range = document.medium.gradient_range.or_else(by_kind);
}

/// The width of the robust range, against which versions that did not state it measured all gradients; `None` for data of a single value.
pub(crate) fn robust_width(volume: &Volume) -> Option<f32> {
    Some(volume.robust_width()).filter(|&width| width > 0.0)
}
