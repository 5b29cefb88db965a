//! Radiance pictures (.hdr, .pic): three mantissas and one exponent per pixel, run-length coded \[Ward91\].

use std::io::{BufRead, Read};

use tyndall::math::{Rgb, cast};

use super::texels::{Map, MapFailure};

/// Longest header that is read, in bytes.
const HEADER_LIMIT: u64 = 1 << 20;
/// Most pixels that one byte of the file can encode: a run of 255 takes 4 bytes.
const PIXELS_PER_BYTE: u64 = 64;
/// Widths that the newer run-length coding, by channel, can encode \[Ward91\].
const BY_CHANNEL: std::ops::RangeInclusive<usize> = 8..=0x7FFF;

type Rgbe = [u8; 4];

pub(super) fn read_map(mut file: impl BufRead, length: u64) -> Result<Map, MapFailure> {
    let header = Header::read(&mut (&mut file).take(HEADER_LIMIT)).map_err(MapFailure::Malformed)?;
    let (width, height) = (header.width, header.height);
    Map::check_size(width as u64, height as u64)?;
    if (width as u64 * height as u64) / PIXELS_PER_BYTE > length {
        let reason = format!("found {length} bytes for {width} x {height} pixels, expected more");
        return Err(MapFailure::Malformed(reason));
    }
    let mut line = vec![[0; 4]; width];
    let mut pixels = Vec::new();
    for row in 0..height {
        let read = read_line(&mut file, &mut line);
        read.map_err(|reason| MapFailure::Malformed(format!("line {row} of {height}: {reason}")))?;
        pixels.extend(line.iter().map(|&rgbe| header.radiance(rgbe)));
    }
    if header.bottom_up {
        pixels = pixels.rchunks(width).flatten().copied().collect();
    }
    if header.right_to_left {
        pixels.chunks_mut(width).for_each(<[Rgb]>::reverse);
    }
    Ok(Map { width, height, pixels })
}

#[derive(Debug)]
struct Header {
    width: usize,
    height: usize,
    bottom_up: bool,
    right_to_left: bool,
    /// Factor by which the file's values were multiplied, by channel.
    gain: [f64; 3],
}

impl Header {
    fn read(file: &mut impl BufRead) -> Result<Self, String> {
        if !read_text(file)?.starts_with("#?") {
            return Err("its first line does not begin with #?".to_owned());
        }
        let mut gain = [1.0; 3];
        loop {
            let line = read_text(file)?;
            match line.split_once('=') {
                _ if line.is_empty() => break,
                Some(("FORMAT", format)) if format.trim() != "32-bit_rle_rgbe" => {
                    return Err(format!("found FORMAT={format}, expected 32-bit_rle_rgbe"));
                }
                Some(("EXPOSURE", text)) => multiply(&mut gain, &[text.trim(); 3])?,
                Some(("COLORCORR", text)) => {
                    multiply(&mut gain, &text.split_whitespace().collect::<Vec<_>>())?;
                }
                _ => {}
            }
        }
        let line = read_text(file)?;
        let orientation = || format!("found orientation `{line}`, expected -Y height +X width");
        let [y, height, x, width] = line.split_whitespace().collect::<Vec<_>>()[..] else {
            return Err(orientation());
        };
        let number = |text: &str| text.parse::<u32>().map(|n| n as usize).map_err(|_| orientation());
        if !matches!((y, x), ("-Y" | "+Y", "+X" | "-X")) {
            return Err(orientation());
        }
        let [width, height] = [number(width)?, number(height)?];
        Ok(Self { width, height, bottom_up: y == "+Y", right_to_left: x == "-X", gain })
    }

    /// Mantissas are used without adding 0.5, so that a zero is black, as in today's programs.
    fn radiance(&self, [r, g, b, exponent]: Rgbe) -> Rgb {
        if exponent == 0 {
            return Rgb::BLACK;
        }
        let scale = f64::from(i16::from(exponent) - 136).exp2();
        let [r, g, b] =
            [(r, 0), (g, 1), (b, 2)].map(|(m, c)| cast::single(f64::from(m) * scale / self.gain[c]));
        Rgb::new(r, g, b)
    }
}

fn multiply(gain: &mut [f64; 3], texts: &[&str]) -> Result<(), String> {
    let numbers: Vec<f64> = texts.iter().filter_map(|text| text.parse().ok()).collect();
    let [r, g, b] = numbers[..] else {
        return Err(format!("found exposure `{}`, expected numbers", texts.join(" ")));
    };
    *gain = [gain[0] * r, gain[1] * g, gain[2] * b];
    if gain.iter().all(|x| x.is_finite() && *x > 0.0) {
        Ok(())
    } else {
        Err(format!("found exposure {gain:?}, expected positive numbers"))
    }
}

fn read_text(file: &mut impl BufRead) -> Result<String, String> {
    let mut line = Vec::new();
    file.read_until(b'\n', &mut line).map_err(|error| error.to_string())?;
    if line.pop() != Some(b'\n') {
        return Err("the file ends inside its header".to_owned());
    }
    Ok(String::from_utf8_lossy(&line).trim_end().to_owned())
}

fn read_line(file: &mut impl BufRead, line: &mut [Rgbe]) -> Result<(), String> {
    let first: Rgbe = bytes(file)?;
    let width = line.len();
    if first[..2] != [2, 2] || first[2] >= 128 || !BY_CHANNEL.contains(&width) {
        return read_pixels(file, first, line);
    }
    let length = usize::from(u16::from_be_bytes([first[2], first[3]]));
    if length != width {
        return Err(format!("found a length of {length}, expected {width}"));
    }
    (0..4).try_for_each(|channel| read_channel(file, channel, line))
}

/// One channel: a count above 128 repeats the next byte count - 128 times; otherwise, count bytes follow.
fn read_channel(file: &mut impl BufRead, channel: usize, line: &mut [Rgbe]) -> Result<(), String> {
    let mut rest = line;
    while !rest.is_empty() {
        let [code] = bytes(file)?;
        let run = code > 128;
        let count = usize::from(if run { code - 128 } else { code });
        if count == 0 || count > rest.len() {
            return Err(format!("found a run of {count}, expected 1 to {}", rest.len()));
        }
        let (now, later) = rest.split_at_mut(count);
        let mut value = [0];
        for (index, pixel) in now.iter_mut().enumerate() {
            if index == 0 || !run {
                value = bytes(file)?;
            }
            [pixel[channel]] = value;
        }
        rest = later;
    }
    Ok(())
}

/// Whole pixels; (1, 1, 1, n) repeats the last pixel n times, and each further such code in a row counts 256-fold.
fn read_pixels(file: &mut impl BufRead, first: Rgbe, line: &mut [Rgbe]) -> Result<(), String> {
    let mut filled = 0;
    let mut unit = 1_usize;
    let mut pixel = first;
    while filled < line.len() {
        if let [1, 1, 1, count] = pixel {
            let count = usize::from(count).saturating_mul(unit);
            let left = line.len() - filled;
            if filled == 0 || count > left {
                return Err(format!("found a run of {count} after {filled} pixels, expected at most {left}"));
            }
            let last = line[filled - 1];
            line[filled..filled + count].fill(last);
            filled += count;
            unit = unit.saturating_mul(256);
        } else {
            line[filled] = pixel;
            filled += 1;
            unit = 1;
        }
        if filled < line.len() {
            pixel = bytes(file)?;
        }
    }
    Ok(())
}

fn bytes<const N: usize>(file: &mut impl BufRead) -> Result<[u8; N], String> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes).map_err(|_| "the file ends there".to_owned())?;
    Ok(bytes)
}
