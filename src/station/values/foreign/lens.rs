//! In: the keys of a file with a camera matrix. Out: the lens's terms under any spelling of their key, and how they
//! were read; an error where a file does not state its lens. Frame and unit: OpenCV's order, signs and units.

use super::keys::{exactly, numbers};
use crate::camera::Distortion;
use crate::fault::{Fault, Result};
use serde_json::{Map, Value};

/// A key of OpenCV's list is one of these words and one of these ends, in any case of letters and with any separators.
const WORDS: [&str; 2] = ["dist", "distortion"];
const ENDS: [&str; 19] = [
    "",
    "s",
    "coef",
    "coefs",
    "coeff",
    "coeffs",
    "coefficient",
    "coefficients",
    "param",
    "params",
    "parameter",
    "parameters",
    "vec",
    "vector",
    "values",
    "terms",
    "array",
    "matrix",
    "list",
];
/// Short names of the same list.
const SHORT: [&str; 3] = ["D", "D1", "d"];
/// Names of single terms.
const TERMS: [&str; 8] = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];

fn is_list(key: &str) -> bool {
    let name = key.replace(|c: char| !c.is_ascii_alphanumeric(), "").to_lowercase();
    SHORT.contains(&key) || WORDS.iter().filter_map(|word| name.strip_prefix(word)).any(|end| ENDS.contains(&end))
}

/// Whether a value can be a list: a text names a model, and one number is something else.
fn stated(v: &Value) -> bool {
    matches!(v, Value::Array(_) | Value::Object(_)) && numbers(v).is_none_or(|n| !n.is_empty())
}

/// OpenCV's 4, 5, 8, 12 or 14 terms, and a remark on them.
///
/// # Errors
/// A lens that is not stated, another number of terms, or two lists that differ. No lens is assumed to be free of
/// distortion.
pub fn terms(file: &Map<String, Value>) -> Result<(Vec<f64>, String)> {
    let there = file.iter().filter(|(key, v)| is_list(key) && stated(v));
    let read = |(key, v)| exactly(v, "the lens", &[4, 5, 8, 12, 14]).map(|terms| (key, terms));
    let lists: Vec<(&String, Vec<f64>)> = there.map(read).collect::<Result<_>>()?;
    let Some((key, terms)) = lists.first() else { return without(file) };
    let lens = Distortion::from_opencv(terms);
    let differs = |name: &&String| {
        let term = TERMS.iter().position(|t| name.eq_ignore_ascii_case(t));
        let stated = file.get(*name).and_then(Value::as_f64);
        term.zip(stated).is_some_and(|(term, stated)| stated != terms.get(term).copied().unwrap_or(0.0))
    };
    let another = lists.iter().find(|(_, terms)| Distortion::from_opencv(terms) != lens).map(|(other, _)| *other);
    if let Some(other) = another.or_else(|| file.keys().find(differs)) {
        return Err(Fault::input(format!("states two lenses that differ: {key} and {other}"))
            .cause("the file of two calibrations, or of two cameras")
            .next("keep the one that belongs to the camera matrix"));
    }
    Ok((terms.clone(), format!("{} lens terms k1 k2 p1 p2 k3 ... of '{key}'", terms.len())))
}

/// The zeros of a camera_info whose lens has no terms; an error for all other files.
fn without(file: &Map<String, Value>) -> Result<(Vec<f64>, String)> {
    let empty = ["D", "d", "distortion_coefficients"]
        .iter()
        .any(|key| file.get(*key).and_then(numbers).is_some_and(|terms| terms.is_empty()));
    // A driver whose pictures have no distortion publishes an empty D; the message always has its distortion_model.
    if let Some(model) = file.get("distortion_model").map(|m| m.as_str().unwrap_or(""))
        && (empty || model == "none")
    {
        return Ok((vec![0.0; 5], format!("no lens terms, distortion_model is '{model}' and D has none")));
    }
    let single = |key: &&String| TERMS.contains(&key.to_lowercase().as_str());
    let single: Vec<&str> = file.keys().filter(single).map(String::as_str).collect();
    let what = if single.is_empty() {
        "does not state its lens: no list of numbers under distortion_coefficients or a similar key".to_owned()
    } else {
        format!("has single lens terms ({}), a list of them is needed", single.join(", "))
    };
    Err(Fault::input(what)
        .cause("another spelling, or a camera whose lens was not calibrated; a lens is not assumed to be ideal")
        .next(
            "write distortion_coefficients: [k1, k2, p1, p2, k3] in OpenCV's order; if the lens has no distortion: \
             distortion_coefficients: [0, 0, 0, 0, 0]",
        ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read(file: Value) -> Result<(Vec<f64>, String)> {
        let Value::Object(map) = file else { panic!("no object") };
        terms(&map)
    }

    #[test]
    fn every_spelling_of_opencvs_list_is_read() {
        let five = [-0.1, 0.05, 0.001, -0.002, 0.01];
        for key in [
            "distortion_coefficients",
            "Distortion_Coefficients",
            "distortionCoefficients",
            "distortion_coeffs",
            "distortion_coeff",
            "distortion_params",
            "distortion_vector",
            "distortion",
            "Distortion",
            "dist_coefficients",
            "dist_coeffs",
            "dist_coeff",
            "dist_coefs",
            "dist-coeffs",
            "distCoeffs",
            "DistCoeffs",
            "distCoeff",
            "dist",
            "D",
            "D1",
            "d",
        ] {
            let (terms, said) = read(json!({ key: [five] })).unwrap_or_else(|e| panic!("{key}: {e}"));
            assert!(terms == five && said.contains("5 lens terms") && said.contains(key), "{key}: {said}");
        }
        // The same lens twice is one lens; four terms are five with k3 = 0.
        let twice = json!({ "dist": five[..4], "D": [-0.1, 0.05, 0.001, -0.002, 0.0], "dist_coeffs": null });
        assert!(read(twice).is_ok());
        let single = json!({ "D": five, "k1": -0.1, "K2": 0.05, "p1": 0.001, "k6": 0 });
        assert!(read(single).is_ok());
        // Other keys that begin alike.
        let more = json!({ "D": five, "distance_mm": [1, 2, 3], "distortion_model": "plumb_bob", "dist": "brown" });
        assert_eq!(read(more).unwrap().0, five);
    }

    #[test]
    fn a_lens_that_is_not_stated_is_never_zero() {
        for file in [
            json!({}),
            json!({ "dist_coeffs": null }),
            json!({ "dist_coeffs": [] }),
            json!({ "D": { "rows": 0, "cols": 0, "data": [] } }),
            json!({ "cam_dist": [-0.1, 0.05, 0.001, -0.002, 0.01] }),
            json!({ "distortion": "plumb_bob" }),
            json!({ "distortion_model": "plumb_bob" }),
            json!({ "dist": 300 }),
        ] {
            let fault = read(file.clone()).err().unwrap_or_else(|| panic!("zeros for {file}"));
            assert!(fault.what.contains("does not state its lens"), "{file}: {fault}");
            assert!(fault.next.contains("distortion_coefficients: [0, 0, 0, 0, 0]"), "{file}: {fault}");
        }
        let five = [-0.1, 0.05, 0.001, -0.002, 0.01];
        let single = read(json!({ "k1": -0.1, "K2": 0.05, "p1": 0 })).unwrap_err();
        assert!(single.what.contains("K2") && single.what.contains("k1") && single.what.contains("p1"), "{single}");
        assert!(single.next.contains("[k1, k2, p1, p2, k3]"), "{single}");
        for (file, wanted) in [
            (json!({ "dist": [-0.1, 0.05, 0, 0, 0], "D": [-0.2, 0.05, 0, 0, 0] }), "two lenses that differ"),
            (json!({ "D": five, "k1": -0.2 }), "two lenses that differ: D and k1"),
            (json!({ "D": five, "k4": 0.3 }), "two lenses that differ: D and k4"),
            (json!({ "dist_coeffs": [-0.1, 0.05, 0] }), "the lens: 3 numbers"),
            (json!({ "dist_coeffs": { "k1": -0.1, "k2": 0.05 } }), "the lens: something else"),
        ] {
            let fault = read(file.clone()).unwrap_err();
            assert!(fault.what.contains(wanted), "{file}: {fault}");
        }
    }

    #[test]
    fn an_empty_list_of_camera_info_is_a_lens_without_distortion_and_said() {
        for model in ["", "plumb_bob"] {
            let (terms, said) = read(json!({ "distortion_model": model, "d": [] })).unwrap();
            assert!(terms == [0.0; 5] && said.contains("no lens terms"), "{said}");
        }
        assert!(read(json!({ "distortion_model": "none" })).is_ok());
    }
}
