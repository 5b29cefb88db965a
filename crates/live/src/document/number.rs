//! Decimal notation of single-precision numbers inside JSON values, which hold double precision.

use serde::Serialize;
use serde_json::{Number, Value};

use tyndall::math::cast;

/// The value that `document` serializes to, with its single-precision numbers as the shortest decimals that read back as the
/// same: 0.04 instead of 0.03999999910593033. Numbers in double precision stay what they are, to the last bit.
///
/// # Errors
/// Those of the type's own serialization.
pub(super) fn to_value(document: &impl Serialize) -> Result<Value, serde_json::Error> {
    let mut value = serde_json::to_value(document)?;
    // As text, a number of either precision is its shortest decimal.
    let text = serde_json::to_string(document)?;
    shorten_as(&mut value, &serde_json::from_str(&text)?);
    Ok(value)
}

/// Replaces single-precision numbers by their shortest decimals, which `short` has at the same places.
fn shorten_as(value: &mut Value, short: &Value) {
    match (value, short) {
        (Value::Number(number), Value::Number(decimal)) if number != decimal => {
            if let Some(short) = number.as_f64().and_then(shortest) {
                *number = short;
            }
        }
        (Value::Array(items), Value::Array(short)) => {
            items.iter_mut().zip(short).for_each(|(item, short)| shorten_as(item, short));
        }
        (Value::Object(table), Value::Object(short)) => {
            table.values_mut().zip(short.values()).for_each(|(item, short)| shorten_as(item, short));
        }
        _ => {}
    }
}

/// The same for a value that has only single-precision numbers.
pub(super) fn shorten(value: &mut Value) {
    match value {
        Value::Number(number) => {
            if let Some(short) = number.as_f64().filter(|_| number.is_f64()).and_then(shortest) {
                *number = short;
            }
        }
        Value::Array(items) => items.iter_mut().for_each(shorten),
        Value::Object(table) => table.values_mut().for_each(shorten),
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

/// The shortest decimal of a number that single precision holds exactly.
///
/// Rounding a decimal to double and then to single precision may differ from rounding it directly to single precision
/// (as for 7.038531e-26); such a number keeps its long notation.
fn shortest(exact: f64) -> Option<Number> {
    let single = cast::single(exact);
    let decimal = single.to_string().parse().ok()?;
    let unchanged =
        f64::from(single).to_bits() == exact.to_bits() && cast::single(decimal).to_bits() == single.to_bits();
    Number::from_f64(decimal).filter(|_| unchanged)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shortened(x: f64) -> f64 {
        let mut value = Value::from(x);
        shorten(&mut value);
        value.as_f64().unwrap()
    }

    #[test]
    fn single_precision_numbers_become_short_decimals() {
        for decimal in [0.04_f32, 0.8, 0.3, 1e-30, 3.4e38, -0.0, 16_777_217.0] {
            let short = shortened(f64::from(decimal));
            assert_eq!(short.to_string(), decimal.to_string());
            assert_eq!(cast::single(short).to_bits(), decimal.to_bits());
        }
    }

    #[test]
    fn double_precision_numbers_stay() {
        #[derive(Serialize)]
        struct Both {
            double: f64,
            single: f32,
        }
        // The last is also a single-precision number, whose decimal is 0.04.
        for double in [0.1, 1.0 / 3.0, 1e300, f64::from(0.04_f32)] {
            let value = to_value(&Both { double, single: 0.04 }).unwrap();
            assert_eq!(value["double"].as_f64().unwrap().to_bits(), double.to_bits());
            assert_eq!(value["single"].to_string(), "0.04");
        }
    }

    #[test]
    fn a_decimal_that_rounds_twice_stays_long() {
        let awkward = f64::from(7.038_531e-26_f32);
        assert_ne!(cast::single(7.038_531e-26_f64).to_bits(), 7.038_531e-26_f32.to_bits());
        assert_eq!(shortened(awkward).to_bits(), awkward.to_bits());
    }
}
