//! Transfer functions ready to use: for CT in Hounsfield units, for MRI, and for any data, adapted to
//! the distribution of its values.

mod adaptive;
mod ct;
mod labels;

use super::{Optics, Point};
use crate::math::{Rgb, cast};
use crate::volume::procedural::MATERIALS;
use crate::volume::{Histogram, Space, Volume};

/// A transfer function by name.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// The name in the scene document.
    pub name: &'static str,
    /// What it shows, in one line.
    pub about: &'static str,
    points: Points,
}

/// How a preset finds its points.
#[derive(Clone, Copy, Debug)]
enum Points {
    /// They are the same for all data.
    Fixed(fn() -> Vec<Point>),
    /// From the distribution of the values.
    Adaptive(fn(&Profile) -> Vec<Point>),
    /// One look for each of a few whole values.
    Labels,
}

/// Why a preset has no points for a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PresetError {
    /// The data are not whole numbers, or too many.
    #[error(
        "`labels` needs 1 to 200 different whole numbers above 0, and 0 as background; these data have fractions, negative or more \
         values, or only 0: use `layers` or `cloud`, or give points"
    )]
    NoLabels,
}

/// All presets.
pub const PRESETS: [Preset; 15] = [
    Preset {
        name: "ct-bone",
        about: "CT: bone, and vessels with contrast agent, as solids",
        points: Points::Fixed(ct::bone),
    },
    Preset {
        name: "ct-skin",
        about: "CT: skin, with what lies below where it is cut",
        points: Points::Fixed(ct::skin),
    },
    Preset {
        name: "ct-skin-bone",
        about: "CT: bone under translucent skin",
        points: Points::Fixed(ct::skin_bone),
    },
    Preset { name: "ct-lung", about: "CT: lungs, under a veil of skin", points: Points::Fixed(ct::lung) },
    Preset {
        name: "ct-muscle",
        about: "CT: muscle and organs, fat removed, with bone",
        points: Points::Fixed(ct::muscle),
    },
    Preset {
        name: "ct-vessels",
        about: "CT with contrast agent: vessels in red, with bone",
        points: Points::Fixed(ct::vessels),
    },
    Preset {
        name: "mri",
        about: "MRI: tissue as a solid, red where it is dark and pale where it is bright",
        points: Points::Adaptive(adaptive::mri),
    },
    Preset {
        name: "mri-glass",
        about: "MRI: brain and bright tissue under skin of blue glass",
        points: Points::Adaptive(adaptive::mri_glass),
    },
    Preset {
        name: "solid",
        about: "any data: all above the background as one solid",
        points: Points::Adaptive(adaptive::solid),
    },
    Preset {
        name: "cloud",
        about: "any data: extinction in proportion to the value",
        points: Points::Adaptive(adaptive::cloud),
    },
    Preset {
        name: "fluorescence",
        about: "any data: glow that grows with the value, as of a dye under the microscope",
        points: Points::Adaptive(adaptive::fluorescence),
    },
    Preset {
        name: "stain",
        about: "any data: a purple stain, the darker the larger the value, for a white background",
        points: Points::Adaptive(adaptive::stain),
    },
    Preset {
        name: "layers",
        about: "any data: a coloured veil at each quarter of the values",
        points: Points::Adaptive(adaptive::layers),
    },
    Preset {
        name: "labels",
        about: "segmentations: every part as a solid in a colour of its own",
        points: Points::Labels,
    },
    Preset {
        name: "cornell-box",
        about: "the materials of the procedural Cornell box",
        points: Points::Fixed(cornell_box),
    },
];

impl Preset {
    /// The preset of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        PRESETS.iter().find(|preset| preset.name == name)
    }

    /// The preset for a volume when nothing was chosen.
    #[must_use]
    pub fn for_volume(volume: &Volume) -> &'static Self {
        if volume.labels().is_some() { Self::of_labels() } else { Self::for_field(volume) }
    }

    /// The preset for a volume that is to be seen as a field, whose values say something about what is beside them.
    #[must_use]
    pub fn for_field(volume: &Volume) -> &'static Self {
        let anatomical = volume.grid().space() == Space::Anatomical;
        let name = if volume.is_ct() {
            "ct-bone"
        } else if volume.value_range()[0] == volume.value_range()[1]
            || adaptive::is_two_phase(&Profile::new(volume))
        {
            "solid"
        } else if anatomical {
            "mri"
        } else {
            "cloud"
        };
        Self::named(name).expect("a preset of this list")
    }

    /// The preset that shows every label.
    #[must_use]
    pub fn of_labels() -> &'static Self {
        Self::named("labels").expect("a preset of this list")
    }

    /// Whether it shows labels, between which nothing is interpolated.
    #[must_use]
    pub fn shows_labels(&self) -> bool {
        matches!(self.points, Points::Labels)
    }

    /// The points for a volume; at least one, ascending.
    ///
    /// # Errors
    /// [`PresetError`] if the preset cannot show such data.
    pub fn points(&self, volume: &Volume) -> Result<Vec<Point>, PresetError> {
        match self.points {
            Points::Fixed(points) => Ok(points()),
            Points::Adaptive(points) => {
                let points = points(&Profile::new(volume));
                let [least, most] = volume.value_range();
                Ok(if least == most { vec![adaptive::of_one_value(&points, least)] } else { points })
            }
            Points::Labels => {
                let values = volume.whole_values().filter(|values| !values.is_empty());
                Ok(labels::labels(values.ok_or(PresetError::NoLabels)?))
            }
        }
    }
}

/// What a preset knows of a volume.
struct Profile<'a> {
    histogram: &'a Histogram,
    /// The labels of a segmentation.
    labels: Option<&'a [f64]>,
}

impl<'a> Profile<'a> {
    fn new(volume: &'a Volume) -> Self {
        Self { histogram: volume.robust_histogram(), labels: volume.labels() }
    }

    /// The value at a share of the robust range.
    fn at(&self, share: f64) -> f32 {
        let [lo, hi] = self.histogram.range;
        cast::single(lo + (hi - lo) * share)
    }
}

/// A point of matter that scatters in a colour.
fn matter(value: f32, opacity: f32, albedo: [f32; 3], surface: f32) -> Point {
    Point { value, optics: Optics { opacity, albedo: Rgb::from(albedo), surface, ..Optics::default() } }
}

/// A point of tissue that scatters in a colour, with a surface that reflects as much as water's does, and sharply where roughness is low.
fn glossy(value: f32, opacity: f32, albedo: [f32; 3], surface: f32, roughness: f32) -> Point {
    /// A little above that of water, 0.02 at right angles, since the reflectance of a BRDF has no total reflection below the skin.
    const SPECULAR: f32 = 0.05;
    let mut point = matter(value, opacity, albedo, surface);
    (point.optics.specular, point.optics.roughness) = (Rgb::splat(SPECULAR), roughness);
    point
}

/// Fig. 4 of \[Jonsson12\]: white walls with one red and one green, thin bluish air.
fn cornell_box() -> Vec<Point> {
    let looks: [(f32, [f32; 3]); 7] = [
        (0.0008, [0.80, 0.88, 0.98]),
        (1.0, [0.85, 0.85, 0.85]),
        (1.0, [0.80, 0.10, 0.08]),
        (1.0, [0.12, 0.62, 0.14]),
        (1.0, [0.90, 0.72, 0.30]),
        (1.0, [0.85, 0.85, 0.85]),
        (0.025, [0.90, 0.95, 0.99]),
    ];
    // Flat around each value, with jumps half way between neighbours.
    let sixteenth = 1.0 / 16.0;
    let flat = |(material, (opacity, albedo)): (&crate::volume::procedural::Material, (f32, [f32; 3]))| {
        [-1.0, 1.0].map(|side| matter(material.value + side * sixteenth, opacity, albedo, 0.0))
    };
    MATERIALS.iter().zip(looks).flat_map(flat).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::TransferFunction;
    use crate::volume::procedural::{Field, Kind};
    use crate::volume::{Grid, ValueMap, Voxels};

    fn volumes() -> Vec<Volume> {
        let mut all: Vec<Volume> =
            Kind::ALL.iter().map(|&(kind, _)| Field::new(kind, [20; 3], 1).volume().unwrap()).collect();
        let grid = || Grid::centred([10, 10, 10], [1.0; 3]).unwrap();
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let anatomical = Grid::new([10; 3], [1.0; 3], axes, [0.0; 3], Space::Anatomical).unwrap();
        let hounsfield = (0..1000).map(|i| (i * 4 - 3000).max(-1000)).collect();
        all.push(Volume::new(anatomical, Voxels::I16(hounsfield), ValueMap::IDENTITY).unwrap());
        // The same range without air.
        let seismic = (0..1000).map(|i| i * 3 - 1500).collect();
        all.push(Volume::new(grid(), Voxels::I16(seismic), ValueMap::IDENTITY).unwrap());
        let sparse = (0..1000).map(|i| if i % 400 == 7 { 1e30 } else { 0.0 }).collect();
        all.push(Volume::new(grid(), Voxels::F32(sparse), ValueMap::IDENTITY).unwrap());
        let flat = Grid::centred([1, 1, 1], [1.0; 3]).unwrap();
        all.push(Volume::new(flat, Voxels::U8(vec![7]), ValueMap::IDENTITY).unwrap());
        all
    }

    #[test]
    fn every_preset_makes_a_function_of_every_volume() {
        for volume in volumes() {
            for preset in PRESETS {
                let range = volume.value_range();
                let Ok(points) = preset.points(&volume) else {
                    assert!(preset.shows_labels() && volume.whole_values().is_none(), "{}", preset.name);
                    continue;
                };
                TransferFunction::new(points)
                    .unwrap_or_else(|e| panic!("{} over {range:?}: {e}", preset.name));
            }
        }
    }

    #[test]
    fn the_automatic_choice_shows_something_of_every_volume() {
        for volume in volumes() {
            let preset = Preset::for_volume(&volume);
            let function = TransferFunction::new(preset.points(&volume).unwrap()).unwrap();
            let [lo, hi] = volume.value_range().map(cast::single);
            assert!(function.opacity_range([lo, hi])[1] > 0.2, "{} over [{lo}, {hi}]", preset.name);
        }
        let names = volumes().iter().map(|v| Preset::for_volume(v).name).collect::<Vec<_>>();
        assert_eq!(names[6..8], ["ct-bone", "cloud"]);
    }
}
