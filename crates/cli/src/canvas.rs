//! A page of pictures and text, in code values.

use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::ascii::FONT_10X20;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::text::Text;
use std::convert::Infallible;

/// Rows from the top, each from the left, sRGB.
pub struct Canvas {
    size: [u32; 2],
    codes: Vec<[u8; 3]>,
}

impl Canvas {
    /// In one colour.
    pub fn new(size: [u32; 2], color: [u8; 3]) -> Self {
        Self { size, codes: vec![color; size[0] as usize * size[1] as usize] }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Its pixels.
    pub fn codes(&self) -> &[[u8; 3]] {
        &self.codes
    }

    /// Puts a picture with its top left corner at a place within the page.
    pub fn put(&mut self, [x, y]: [u32; 2], [width, _]: [u32; 2], picture: &[[u8; 3]]) {
        let stride = self.size[0] as usize;
        for (row, pixels) in (y as usize..).zip(picture.chunks(width as usize)) {
            let first = row * stride + x as usize;
            self.codes[first..first + pixels.len()].copy_from_slice(pixels);
        }
    }

    /// Writes a line that begins at a place on its base line; what leaves the page is cut off.
    pub fn write(&mut self, [x, y]: [u32; 2], text: &str, [r, g, b]: [u8; 3]) {
        let style = MonoTextStyle::new(&FONT_10X20, Rgb888::new(r, g, b));
        let at = Point::new(x.cast_signed(), y.cast_signed());
        let Ok(_) = Text::new(text, at, style).draw(self);
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.size[0], self.size[1])
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        let [width, height] = self.size;
        for Pixel(at, color) in pixels {
            let inside = |n: i32, end: u32| u32::try_from(n).ok().filter(|n| *n < end);
            if let (Some(x), Some(y)) = (inside(at.x, width), inside(at.y, height)) {
                self.codes[y as usize * width as usize + x as usize] = [color.r(), color.g(), color.b()];
            }
        }
        Ok(())
    }
}
