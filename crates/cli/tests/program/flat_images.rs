//! Images, volumes of one voxel along an axis, are seen from the front without options.

use crate::data::{Data, picture, ways};
use crate::support::Folder;
use serde_json::json;

/// Whichever axis is thin, nearly all of the picture is covered, by every method; edge-on it would be a line.
#[test]
fn an_image_fills_the_picture_whichever_axis_is_thin() {
    let folder = Folder::new();
    for thin in 0..3 {
        let mut dims = [48; 3];
        dims[thin] = 1;
        let data = Data::of_dims(dims, |[x, y, z]| 100.0 + 50.0 * x + 40.0 * y + 30.0 * z);
        for data in [data.clone(), data.anatomical()] {
            folder.put("a.nrrd", data.nrrd("short"));
            for way in ways() {
                let seen = json!({ "transfer_function": { "points": [{ "value": 0, "opacity": 1 }] },
                                   "render": { "samples": 4 }, "film": { "background": "transparent" } });
                let image = picture(&folder, "a.nrrd", &seen, way);
                let covered = image.rgba.iter().filter(|pixel| pixel[3] > 0.3).count() as f64;
                let share = covered / image.rgba.len() as f64;
                assert!(share > 0.8, "axis {thin}: {share} covered with {way:?}");
                let light = image.rgba.iter().map(|pixel| pixel[1]).fold(0.0, f32::max);
                assert!(light > 0.02, "axis {thin}: {light} at most with {way:?}");
            }
        }
    }
}
