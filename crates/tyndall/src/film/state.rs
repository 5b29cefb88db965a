//! The whole state of a film as layers of numbers, so that another run can go on from it to the bits of a run without a break.

use super::Film;
use super::estimate::{CHUNK, QUANTITIES};
use super::tile::{StoredAt, UnevenSamples};
use super::tree::Place;
use crate::math::cast;
use std::collections::HashMap;

/// The samples of a film: numbers for each pixel, row by row from the top.
///
/// Layer `next` is the number of the sample that the pixel takes next. Samples are stored as `film/estimate.rs` describes:
/// `node.L.Q` is quantity `Q` of the merged children of the incomplete node of level `L`, and `edge.L.K.Q` that of the `K`-th child
/// of a node that begins before the first sample. `open.Q.high` and `open.Q.low` are the two halves of the sums over the incomplete
/// chunk, in double precision. Where a pixel has none of these, they are 0.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmState {
    /// Width and height.
    pub size: [u32; 2],
    /// Number of the first sample.
    pub first: u32,
    /// The layers.
    pub layers: Vec<StateLayer>,
}

/// A number for each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct StateLayer {
    /// Its name.
    pub name: String,
    /// The numbers, row by row from the top.
    pub values: StateValues,
}

/// The numbers of a layer.
#[derive(Clone, Debug, PartialEq)]
pub enum StateValues {
    /// In single precision.
    Float(Vec<f32>),
    /// Whole numbers, or bits.
    Whole(Vec<u32>),
}

impl StateValues {
    /// Number of pixels.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a picture is never empty")]
    pub fn len(&self) -> usize {
        match self {
            Self::Float(values) => values.len(),
            Self::Whole(values) => values.len(),
        }
    }
}

/// Why layers are not the state of a film.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// A layer is missing, of the wrong type or of the wrong size.
    #[error("found no layer `state.{0}` of the right type with a number for each pixel")]
    Layer(String),
    /// The number of the first sample does not begin a chunk.
    #[error("found {0} as the number of its first sample, expected a multiple of {CHUNK}")]
    First(u32),
    /// A pixel's number of samples does not fit those of the pixels around it.
    #[error("found {found} samples in pixel {position:?}, expected {expected}, to fit the rest of its tile")]
    Samples {
        /// Column and row.
        position: [u32; 2],
        /// The number found.
        found: u32,
        /// The number expected.
        expected: u32,
    },
}

/// Name of the layer with the number of the sample that each pixel takes next.
const NEXT: &str = "next";

/// Names of the quantities, in their order: means of red, green and blue, the spread of each and of luminance, alpha, depth.
const NAMES: [&str; QUANTITIES] = ["R", "G", "B", "RR", "GG", "BB", "YY", "A", "Z"];

fn name_of(place: Place, quantity: usize) -> String {
    let quantity = NAMES[quantity];
    match place {
        Place::Edge(child) => format!("edge.{}.{}.{quantity}", child.parent_level, child.sibling()),
        Place::Node(level) => format!("node.{level}.{quantity}"),
        Place::Open => format!("open.{quantity}"),
    }
}

/// The names of the two halves of a layer in double precision.
fn halves(name: &str) -> [String; 2] {
    ["high", "low"].map(|half| format!("{name}.{half}"))
}

impl Film {
    /// Its whole state.
    #[must_use]
    pub fn state(&self) -> FilmState {
        let mut next = vec![0; self.pixel_count()];
        let mut stored: Vec<(Place, [Vec<f64>; QUANTITIES])> = Vec::new();
        for tile in &self.tiles {
            for pixel in 0..tile.pixel_count() {
                next[self.index_of(tile.position(pixel))] = tile.next_sample(pixel);
            }
            for StoredAt { pixel, place } in tile.stored() {
                let known = stored.iter().position(|(known, _)| *known == place);
                let index = known.unwrap_or_else(|| {
                    stored.push((place, std::array::from_fn(|_| vec![0.0; next.len()])));
                    stored.len() - 1
                });
                let at = self.index_of(tile.position(pixel));
                for (layer, value) in stored[index].1.iter_mut().zip(tile.tree().stored(pixel, place)) {
                    layer[at] = value;
                }
            }
        }
        let mut layers = vec![StateLayer { name: NEXT.to_owned(), values: StateValues::Whole(next) }];
        for (place, quantities) in stored {
            for (quantity, values) in quantities.into_iter().enumerate() {
                let name = name_of(place, quantity);
                if place == Place::Open {
                    let half = |shift: u32| values.iter().map(move |x| cast::low_u32(x.to_bits() >> shift));
                    for (name, shift) in halves(&name).into_iter().zip([32, 0]) {
                        layers.push(StateLayer { name, values: StateValues::Whole(half(shift).collect()) });
                    }
                } else {
                    let values = values.into_iter().map(cast::single).collect();
                    layers.push(StateLayer { name, values: StateValues::Float(values) });
                }
            }
        }
        FilmState { size: self.size, first: self.first(), layers }
    }

    /// The film with this state.
    ///
    /// # Errors
    /// [`StateError`] if the layers are not the state of a film.
    pub fn from_state(state: &FilmState) -> Result<Self, StateError> {
        if !state.first.is_multiple_of(CHUNK) {
            return Err(StateError::First(state.first));
        }
        let mut film = Self::part(state.size, state.first);
        let layers = Layers::new(state, film.pixel_count());
        let width = state.size[0] as usize;
        let index_of = |[x, y]: [u32; 2]| y as usize * width + x as usize;
        let next = layers.whole(NEXT)?;
        let mut stored: Vec<(Place, [Values; QUANTITIES])> = Vec::new();
        for tile in &mut film.tiles {
            tile.go_on_after(|position| next[index_of(position)]).map_err(
                |UnevenSamples { position, found, expected }| StateError::Samples {
                    position,
                    found,
                    expected,
                },
            )?;
            for StoredAt { pixel, place } in tile.stored() {
                let index = match stored.iter().position(|(known, _)| *known == place) {
                    Some(known) => known,
                    None => {
                        stored.push((place, layers.values(place)?));
                        stored.len() - 1
                    }
                };
                let at = index_of(tile.position(pixel));
                tile.tree_mut().restore(pixel, place, std::array::from_fn(|q| stored[index].1[q].at(at)));
            }
        }
        Ok(film)
    }

    fn index_of(&self, [x, y]: [u32; 2]) -> usize {
        y as usize * self.size[0] as usize + x as usize
    }
}

/// The layers of a state by name.
struct Layers<'a> {
    of_name: HashMap<&'a str, &'a StateValues>,
    pixels: usize,
}

/// A quantity of all pixels.
enum Values<'a> {
    Single(&'a [f32]),
    Double { high: &'a [u32], low: &'a [u32] },
}

impl Values<'_> {
    fn at(&self, pixel: usize) -> f64 {
        match self {
            Self::Single(values) => f64::from(values[pixel]),
            Self::Double { high, low } => {
                f64::from_bits(u64::from(high[pixel]) << 32 | u64::from(low[pixel]))
            }
        }
    }
}

impl<'a> Layers<'a> {
    fn new(state: &'a FilmState, pixels: usize) -> Self {
        let of_name = state.layers.iter().map(|layer| (layer.name.as_str(), &layer.values)).collect();
        Self { of_name, pixels }
    }

    fn get(&self, name: &str) -> Result<&'a StateValues, StateError> {
        let found = self.of_name.get(name).copied().filter(|values| values.len() == self.pixels);
        found.ok_or_else(|| StateError::Layer(name.to_owned()))
    }

    fn whole(&self, name: &str) -> Result<&'a [u32], StateError> {
        match self.get(name)? {
            StateValues::Whole(values) => Ok(values),
            StateValues::Float(_) => Err(StateError::Layer(name.to_owned())),
        }
    }

    fn values(&self, place: Place) -> Result<[Values<'a>; QUANTITIES], StateError> {
        let mut found = Vec::with_capacity(QUANTITIES);
        for quantity in 0..QUANTITIES {
            let name = name_of(place, quantity);
            found.push(if place == Place::Open {
                let [high, low] = halves(&name);
                Values::Double { high: self.whole(&high)?, low: self.whole(&low)? }
            } else {
                match self.get(&name)? {
                    StateValues::Float(values) => Values::Single(values),
                    StateValues::Whole(_) => return Err(StateError::Layer(name)),
                }
            });
        }
        found.try_into().map_err(|_| StateError::Layer(name_of(place, 0)))
    }
}
