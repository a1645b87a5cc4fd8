//! In: pictures of a camera whose levels are not proportional to the light (sRGB, a gamma). Out: the same pictures with
//! levels proportional to the light, through a table.
//! Frame and unit: grey levels; 8 bits become 12, deeper ones 16, so that dark levels stay distinct.

use super::{Image, Pixels};

/// How a camera's levels follow the light.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "Stated", into = "Stated")]
pub enum Response {
    /// Proportional to the light.
    Linear,
    /// IEC 61966-2-1.
    Srgb,
    /// level = light^(1 / gamma), both as shares of full scale.
    Gamma(f64),
}

/// As a file states it: a name or a number.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
enum Stated {
    Name(String),
    Gamma(f64),
}

impl TryFrom<Stated> for Response {
    type Error = String;
    fn try_from(stated: Stated) -> Result<Response, String> {
        match stated {
            Stated::Name(name) if name == "linear" => Ok(Response::Linear),
            Stated::Name(name) if name == "srgb" => Ok(Response::Srgb),
            Stated::Gamma(g) if (1.0..=4.0).contains(&g) => Ok(Response::Gamma(g)),
            Stated::Name(name) => {
                Err(format!("response '{name}' is not known: \"linear\", \"srgb\" or a gamma from 1 to 4"))
            }
            Stated::Gamma(g) => Err(format!("response is a gamma of {g}, 1 to 4 is read")),
        }
    }
}

impl From<Response> for Stated {
    fn from(response: Response) -> Stated {
        match response {
            Response::Linear => Stated::Name("linear".into()),
            Response::Srgb => Stated::Name("srgb".into()),
            Response::Gamma(g) => Stated::Gamma(g),
        }
    }
}

impl Response {
    /// Depth of the linear pictures that files of `bits` become.
    pub fn depth(self, bits: u8) -> u8 {
        match self {
            Response::Linear => bits,
            _ if bits == 8 => 12,
            _ => 16,
        }
    }

    /// The light that gives a level, both as shares of full scale.
    fn light(self, level: f64) -> f64 {
        match self {
            Response::Linear => level,
            Response::Srgb if level <= 0.04045 => level / 12.92,
            Response::Srgb => ((level + 0.055) / 1.055).powf(2.4),
            Response::Gamma(g) => level.powf(g),
        }
    }

    /// The picture with levels proportional to the light; saturated pixels stay saturated.
    pub fn linear(self, image: Image) -> Image {
        if self == Response::Linear {
            return image;
        }
        let (full, bits) = (image.full_scale(), self.depth(image.bits));
        let top = ((1u32 << bits) - 1) as f64;
        let table: Vec<u16> =
            (0..=full).map(|v| (self.light(f64::from(v) / f64::from(full)) * top).round() as u16).collect();
        let levels = match &image.pixels {
            Pixels::U8(p) => p.iter().map(|&v| table[usize::from(v)]).collect(),
            Pixels::U16(p) => p.iter().map(|&v| table[usize::from(v)]).collect(),
        };
        Image::from_u16(image.width, image.height, bits, levels)
    }

    /// Remark for a report on pictures that were made linear.
    pub fn remark(self, bits: u8) -> Option<String> {
        let name = match self {
            Response::Linear => return None,
            Response::Srgb => "sRGB".to_owned(),
            Response::Gamma(g) => format!("a gamma of {g}"),
        };
        // Slope of light over level at the top, where a stripe's peak is.
        let steep = (self.light(1.0) - self.light(0.999)) / 0.001;
        Some(format!(
            "the pictures follow {name} and were made linear at load, {bits} bits to {}. Near full scale one of \
             their levels is {steep:.1} linear ones, so bright pixels are coarser and noisier than a linear camera's. \
             Saturated pixels stay saturated",
            self.depth(bits)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_become_light() {
        let ramp = Image::from_u8(256, 1, (0..=255).collect());
        for (response, half) in [(Response::Srgb, 188), (Response::Gamma(2.2), 186)] {
            let linear = response.linear(ramp.clone());
            let Pixels::U16(p) = &linear.pixels else { panic!("12 bits") };
            assert_eq!((linear.bits, p[0], p[255]), (12, 0, 4095));
            assert!(p.windows(2).all(|w| w[0] <= w[1]));
            // Half of the light, from the standards' own inverse: 0.7354 and 0.7297 of full scale.
            assert!((f64::from(p[half]) / 4095.0 - 0.5).abs() < 0.005, "{}", p[half]);
            assert!(response.remark(8).unwrap().contains("12"));
        }
        assert_eq!(Response::Linear.linear(ramp.clone()), ramp);
        let read = |text: &str| serde_json::from_str::<Response>(text);
        assert_eq!(read("\"srgb\"").unwrap(), Response::Srgb);
        assert_eq!(read("2.2").unwrap(), Response::Gamma(2.2));
        assert_eq!(serde_json::to_string(&Response::Gamma(2.2)).unwrap(), "2.2");
        for wrong in ["\"sRGB \"", "0.45", "1e300", "null"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
