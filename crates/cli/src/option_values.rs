//! Values of options, read from text.

use crate::parts::Share;
use std::time::Duration;

/// Width and height.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |s: &str| s.parse::<u32>().ok().filter(|&n| n > 0);
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| Some([side(w)?, side(h)?]))
        .ok_or_else(|| "expected WxH with whole numbers of at least 1, e.g. 512x512".into())
}

/// A part of a render.
pub fn share(text: &str) -> Result<Share, String> {
    let numbers =
        text.split_once('/').and_then(|(number, count)| Some([number.parse().ok()?, count.parse().ok()?]));
    numbers
        .map(|[number, count]| Share { number, count })
        .filter(|share| (1..=share.count).contains(&share.number))
        .ok_or_else(|| "expected K/N with whole numbers, K from 1 to N, e.g. 2/4".into())
}

/// A finite number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|x: &f64| x.is_finite() && *x > 0.0)
        .ok_or_else(|| "expected a number above 0".into())
}

/// A time; more seconds than the clock can count mean no limit.
pub fn seconds(text: &str) -> Result<Duration, String> {
    positive(text).map(|x| Duration::try_from_secs_f64(x).unwrap_or(Duration::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_what_they_say_or_refused() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        for bad in ["640", "0x4", "x", "4x-1", "axb"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(share("2/4"), Ok(Share { number: 2, count: 4 }));
        for bad in ["0/4", "5/4", "1", "1/", "/", "1/0", "-1/2", "1/2/3", "a/b"] {
            assert!(share(bad).is_err(), "{bad}");
        }
        assert!(positive("nan").is_err() && positive("0").is_err() && positive("0.5") == Ok(0.5));
    }

    #[test]
    fn seconds_are_never_too_many() {
        assert_eq!(seconds("1.5"), Ok(Duration::from_millis(1500)));
        assert_eq!(seconds("1e300"), Ok(Duration::MAX));
        assert!(seconds("inf").is_err() && seconds("-1").is_err());
    }
}
