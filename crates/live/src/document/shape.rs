//! The shapes that values of the document take in its JSON Schema: numbers with a range, vectors, colours.
//!
//! These types exist only for the schema and have no values; the document's own fields are plain numbers and arrays.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};

macro_rules! shapes {
    ($($(#[$doc:meta])* $name:ident = $schema:tt;)*) => {$(
        $(#[$doc])*
        pub(super) enum $name {}

        impl JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!($schema)
            }
        }
    )*};
}

shapes! {
    /// The version of the document format.
    Version = { "type": "integer", "format": "uint32", "minimum": 1, "maximum": 1 };
    /// A number of at least 0.
    NonNegative = { "type": "number", "format": "float", "minimum": 0 };
    /// A number above 0.
    Positive = { "type": "number", "format": "float", "exclusiveMinimum": 0 };
    /// A number above 0 in double precision.
    PositiveDouble = { "type": "number", "format": "double", "exclusiveMinimum": 0 };
    /// A fraction from 0 to 1.
    Fraction = { "type": "number", "format": "float", "minimum": 0, "maximum": 1 };
    /// The shape of a lobe; at -1 and 1, which are excluded, the lobe is no longer a function.
    MeanCosine = { "type": "number", "format": "float", "exclusiveMinimum": -1, "exclusiveMaximum": 1 };
    /// The full angle of a cone, in degrees.
    ConeAngle = { "type": "number", "format": "float", "minimum": 0, "maximum": 180 };
    /// The angle from edge to edge of a softbox, in degrees.
    BoxAngle = { "type": "number", "format": "float", "minimum": 1, "maximum": 180 };
    /// A vertical field of view, in degrees.
    FieldOfView = { "type": "number", "format": "float", "exclusiveMinimum": 0, "exclusiveMaximum": 180 };
    /// An angle above the horizon, in degrees.
    Elevation = { "type": "number", "format": "float", "minimum": -90, "maximum": 90 };
    /// Stops, limited so that powers of two stay in the range of single precision.
    Stops = { "type": "number", "format": "float", "minimum": -100, "maximum": 100 };
    /// A number of scattering events.
    ScatteringOrder = { "type": "integer", "format": "uint32", "minimum": 0, "maximum": 1_000_000 };
    /// A number of samples per pixel, up to 2^31.
    Samples = { "type": "integer", "format": "uint32", "minimum": 1, "maximum": 2_147_483_648_u32 };
    /// An edge in voxels, or 0.
    MajorantCell = { "type": "integer", "format": "uint32", "minimum": 0, "maximum": 4096 };
    /// A position in world space; the ends keep distances within single precision.
    Position = {
        "type": "array",
        "items": { "type": "number", "format": "double", "minimum": -1e38, "maximum": 1e38 },
        "minItems": 3,
        "maxItems": 3
    };
    /// A data value; the ends are those of single precision.
    DataValue = { "type": "number", "format": "double", "minimum": -3.402_823_466e38, "maximum": 3.402_823_466e38 };
    /// A direction in world space.
    Vector = {
        "type": "array",
        "items": { "type": "number", "format": "float" },
        "minItems": 3,
        "maxItems": 3
    };
    /// Linear red, green and blue from 0 to 1e18; one number is grey. The upper end is [`tyndall::light::BRIGHTEST`].
    Color = {
        "oneOf": [
            { "type": "number", "format": "float", "minimum": 0, "maximum": 1e18 },
            {
                "type": "array",
                "items": { "type": "number", "format": "float", "minimum": 0, "maximum": 1e18 },
                "minItems": 3,
                "maxItems": 3
            }
        ]
    };
    /// A fraction per colour channel; one number is grey.
    FractionColor = {
        "oneOf": [
            { "type": "number", "format": "float", "minimum": 0, "maximum": 1 },
            {
                "type": "array",
                "items": { "type": "number", "format": "float", "minimum": 0, "maximum": 1 },
                "minItems": 3,
                "maxItems": 3
            }
        ]
    };
}

/// The numbers of voxels or pixels along `N` axes, each at least 1.
pub(super) enum Size<const N: usize> {}

impl<const N: usize> JsonSchema for Size<N> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("Size{N}").into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "array",
            "items": { "type": "integer", "format": "uint32", "minimum": 1 },
            "minItems": N,
            "maxItems": N
        })
    }
}
