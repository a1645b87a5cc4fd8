//! Writes a camera as OpenCV, ROS and Kalibr read it, with all digits.

use crate::camera::{Distortion, Intrinsics};
use crate::fault::{Fault, Result};

/// The program that a file is written for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Format {
    /// This program: all values of the rig.
    #[default]
    Values,
    /// `cv::FileStorage`; YAML, XML or JSON by the file's name.
    Opencv,
    /// `camera_info`, YAML.
    Ros,
    /// A chain of one camera, YAML.
    Kalibr,
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Format>("format", word)
}

/// The text of a file for another program; `extension` is that of the file's name.
///
/// # Errors
/// The other program has no representation for a term of the lens, or for skew.
pub fn written(camera: &Intrinsics, format: Format, extension: &str) -> Result<String> {
    match (format, extension) {
        (Format::Opencv, "xml") => Ok(opencv_xml(camera)),
        (Format::Opencv, "json") => Ok(opencv_json(camera)),
        (Format::Opencv, "yaml" | "yml") => Ok(opencv_yaml(camera)),
        (Format::Ros, "yaml" | "yml") => ros(camera),
        (Format::Kalibr, "yaml" | "yml") => kalibr(camera),
        (format, other) => {
            let name: &str = format.into();
            let wanted = if format == Format::Opencv { ".yaml, .yml, .xml or .json" } else { ".yaml or .yml" };
            Err(Fault::usage(format!("a file for {name} ends in {wanted}, this one in '.{other}'"))
                .next("give --out another name"))
        }
    }
}

/// Numbers in a form that every reader accepts: with a point or an exponent.
fn list(numbers: &[f64]) -> String {
    numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", ")
}

fn matrix(k: &Intrinsics) -> [f64; 9] {
    [k.fx, k.skew, k.cx, 0.0, k.fy, k.cy, 0.0, 0.0, 1.0]
}

fn opencv_yaml(k: &Intrinsics) -> String {
    let (matrix, lens) = (matrix(k), k.distortion.to_opencv());
    let part = |name: &str, rows: usize, numbers: &[f64]| {
        let cols = numbers.len() / rows;
        format!("{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {} ]\n", list(numbers))
    };
    format!(
        "%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n{}{}",
        k.width,
        k.height,
        part("camera_matrix", 3, &matrix),
        part("distortion_coefficients", 1, lens)
    )
}

fn opencv_xml(k: &Intrinsics) -> String {
    let (matrix, lens) = (matrix(k), k.distortion.to_opencv());
    let part = |name: &str, rows: usize, numbers: &[f64]| {
        let (cols, data) = (numbers.len() / rows, list(numbers).replace(", ", " "));
        format!(
            "<{name} type_id=\"opencv-matrix\">\n  <rows>{rows}</rows>\n  <cols>{cols}</cols>\n  <dt>d</dt>\n  \
             <data>\n    {data}</data></{name}>\n"
        )
    };
    format!(
        "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>{}</image_width>\n\
         <image_height>{}</image_height>\n{}{}</opencv_storage>\n",
        k.width,
        k.height,
        part("camera_matrix", 3, &matrix),
        part("distortion_coefficients", 1, lens)
    )
}

fn opencv_json(k: &Intrinsics) -> String {
    let (matrix, lens) = (matrix(k), k.distortion.to_opencv());
    let part = |name: &str, rows: usize, numbers: &[f64]| {
        let cols = numbers.len() / rows;
        format!(
            "    \"{name}\": {{\n        \"type_id\": \"opencv-matrix\",\n        \"rows\": {rows},\n        \
             \"cols\": {cols},\n        \"dt\": \"d\",\n        \"data\": [ {} ]\n    }}",
            list(numbers)
        )
    };
    format!(
        "{{\n    \"image_width\": {},\n    \"image_height\": {},\n{},\n{}\n}}\n",
        k.width,
        k.height,
        part("camera_matrix", 3, &matrix),
        part("distortion_coefficients", 1, lens)
    )
}

/// Refuses a lens with more terms than the other program knows.
fn terms(d: &Distortion, most: usize, program: &str) -> Result<Vec<f64>> {
    let used = d.0.iter().rposition(|t| *t != 0.0).map_or(0, |i| i + 1);
    if used > most {
        return Err(Fault::input(format!("the lens has {used} terms, {program} has words for {most}"))
            .cause("calibrated with more terms than the other program knows")
            .next("calibrate with fewer terms (--lens four, --lens five), or write the file for OpenCV"));
    }
    Ok(d.0[..most].to_vec())
}

fn ros(k: &Intrinsics) -> Result<String> {
    let lens = terms(&k.distortion, 8, "ROS")?;
    let (model, lens) =
        if k.distortion.is_brown() { ("plumb_bob", &lens[..5]) } else { ("rational_polynomial", &lens[..]) };
    let part = |name: &str, rows: usize, numbers: &[f64]| {
        format!("{name}:\n  rows: {rows}\n  cols: {}\n  data: [{}]\n", numbers.len() / rows, list(numbers))
    };
    let upright = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let projection = [k.fx, k.skew, k.cx, 0.0, 0.0, k.fy, k.cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    Ok(format!(
        "image_width: {}\nimage_height: {}\ncamera_name: sheetlight\n{}distortion_model: {model}\n{}{}{}",
        k.width,
        k.height,
        part("camera_matrix", 3, &matrix(k)),
        part("distortion_coefficients", 1, lens),
        part("rectification_matrix", 3, &upright),
        part("projection_matrix", 3, &projection)
    ))
}

fn kalibr(k: &Intrinsics) -> Result<String> {
    let lens = terms(&k.distortion, 4, "Kalibr's radtan")?;
    if k.skew != 0.0 {
        return Err(Fault::input(format!("the camera's skew is {}, Kalibr has no word for it", k.skew))
            .next("calibrate without skew"));
    }
    Ok(format!(
        "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [{}]\n  distortion_model: radtan\n  intrinsics: [{}]\n  \
         resolution: [{}, {}]\n",
        list(&lens),
        list(&[k.fx, k.fy, k.cx, k.cy]),
        k.width,
        k.height
    ))
}

#[cfg(test)]
mod tests {
    use super::super::camera;
    use super::*;

    fn with(terms: &[f64]) -> Intrinsics {
        let distortion = Distortion::from_opencv(terms).unwrap();
        let (fx, fy) = (612.345_678_901_234_5, 611.1);
        Intrinsics { fx, fy, cx: 321.25, cy: 239.5, skew: 0.0, distortion, width: 640, height: 480 }
    }

    #[test]
    fn what_is_written_is_read_again_to_the_last_digit() {
        let short = with(&[-0.21, 1e-5, 3.0e-4, -7.25e-5]);
        let long = with(&[-0.21, 0.07, 3.0e-4, -7.25e-5, 0.01, 0.02, -0.03, 0.004]);
        let tilted = with(&[-0.2, 0.1, 1e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 2e-3, 0.0, 0.01, -0.02]);
        for (format, extension, cameras) in [
            (Format::Opencv, "yaml", &[short, long, tilted][..]),
            (Format::Opencv, "xml", &[short, long, tilted]),
            (Format::Opencv, "json", &[short, long, tilted]),
            (Format::Ros, "yaml", &[short, long]),
            (Format::Kalibr, "yml", &[short]),
        ] {
            for c in cameras {
                let text = written(c, format, extension).unwrap();
                let (again, said) = camera(&text).unwrap().unwrap_or_else(|| panic!("{format:?}: {text}"));
                assert_eq!(again, *c, "{format:?} {extension}: {text}");
                assert!(said.contains("centre of a pixel"), "{said}");
            }
        }
        assert!(written(&tilted, Format::Ros, "yaml").unwrap_err().what.contains("14 terms"));
        assert!(written(&long, Format::Kalibr, "yaml").unwrap_err().what.contains("radtan"));
        assert!(written(&short, Format::Ros, "xml").unwrap_err().what.contains(".yaml"));
    }
}
