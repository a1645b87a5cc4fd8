//! Reads where a TIFF of a map of the land (GeoTIFF) puts its pixels: distance, direction of the rows, unit of heights.

use super::turn::Orientation;

/// Column and row to x and y: the linear part of ModelTransformation, if it is one.
fn linear(matrix: &[f64]) -> Option<[f64; 4]> {
    let [a, b, _, _, d, e, ..] = *matrix else { return None };
    let whole = matrix.len() == 16 && a * e - b * d != 0.0 && [a, b, d, e].iter().all(|v| v.is_finite());
    whole.then_some([a, b, d, e])
}

/// How a picture is stored whose transformation is no turn of one with x along the columns and y against the rows: its
/// rows run upwards, or its columns to the left.
pub(super) fn orientation(matrix: &[f64]) -> Option<Orientation> {
    let [a, b, d, e] = linear(matrix)?;
    let number = if a < 0.0 && b == 0.0 && d == 0.0 { 2 } else { 4 };
    (a * e - b * d > 0.0).then_some(Orientation { number, by: "ModelTransformation, tag 34264" })
}

/// Distance of columns and rows, in a unit that the file does not name.
pub(super) fn spacing(scale: Option<&[f64]>, matrix: Option<&[f64]>) -> Option<([f64; 2], String)> {
    let by = |tag: &str| format!("a unit that it does not name ({tag})");
    match (scale, matrix.and_then(linear)) {
        (Some([x, y, ..]), _) => Some(([*x, *y], by("ModelPixelScale, tag 33550"))),
        (_, Some([a, b, d, e])) => Some(([a.hypot(d), b.hypot(e)], by("ModelTransformation, tag 34264"))),
        _ => None,
    }
}

/// Notes on statements that programs follow differently.
pub(super) fn notes(scale: Option<&[f64]>, matrix: Option<&[f64]>) -> Vec<String> {
    let mut notes = vec![];
    let heights = [
        (scale.and_then(|s| s.get(2)), "ModelPixelScale, tag 33550"),
        (matrix.filter(|m| m.len() == 16).map(|m| &m[10]), "ModelTransformation, tag 34264"),
    ];
    for (scale, by) in heights {
        if let Some(scale) = scale.filter(|s| **s != 0.0 && **s != 1.0) {
            notes.push(format!(
                "the file says that a height is {scale} of a sample ({by}), which programs follow differently: it was \
                 not applied, --unit-mm is used, as stated"
            ));
        }
    }
    if let Some([x, y, ..]) = scale
        && (*x < 0.0 || *y < 0.0)
    {
        notes.push(format!(
            "the file says that its pixels are {x} x {y} apart (ModelPixelScale, tag 33550), which programs follow \
             differently: the picture was not turned; --rows-up takes its rows as running upwards"
        ));
    }
    notes
}

/// The unit of heights (VerticalUnitsGeoKey), mm.
pub(super) fn vertical_unit(keys: &[u16]) -> Option<(f64, String)> {
    let value = keys.chunks_exact(4).skip(1).find(|k| k[0] == 4099 && k[1] == 0)?[3];
    let (mm, name) = match value {
        9001 => (1000.0, "metre"),
        9002 => (304.8, "foot"),
        9003 => (1_200_000.0 / 3937.0, "US survey foot"),
        _ => return None,
    };
    Some((mm, format!("{name} (VerticalUnits, tag 34735)")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix([a, b, d, e]: [f64; 4], k: f64) -> Vec<f64> {
        [[a, b, 0.0, 7.0], [d, e, 0.0, 9.0], [0.0, 0.0, k, 0.0], [0.0, 0.0, 0.0, 1.0]].concat()
    }

    #[test]
    fn only_mirrored_maps_are_turned() {
        for (m, wanted) in [
            ([0.5, 0.0, 0.0, -0.5], None),
            ([0.5, 0.0, 0.0, 0.5], Some(4)),
            ([-0.5, 0.0, 0.0, -0.5], Some(2)),
            ([-0.5, 0.0, 0.0, 0.5], None),
            ([0.0, 0.5, 0.5, 0.0], None),
            ([0.0, 0.5, -0.5, 0.0], Some(4)),
            ([0.0, 0.0, 0.0, 0.0], None),
            ([f64::NAN, 0.0, 0.0, 1.0], None),
        ] {
            assert_eq!(orientation(&matrix(m, 0.0)).map(|o| o.number), wanted, "{m:?}");
        }
        assert!(orientation(&[1.0, 0.0]).is_none());
        assert_eq!(spacing(None, Some(&matrix([0.3, 0.0, 0.4, -2.0], 0.0))).unwrap().0, [0.5, 2.0]);
        assert!(notes(Some(&[1.0, 1.0, 0.001]), Some(&matrix([1.0, 0.0, 0.0, -1.0], 2.0))).len() == 2);
        assert!(notes(Some(&[1.0, 1.0, 0.0]), None).is_empty() && notes(Some(&[1.0, -1.0, 0.0]), None).len() == 1);
        assert_eq!(vertical_unit(&[1, 1, 0, 1, 4099, 0, 1, 9002]).unwrap().0, 304.8);
        assert!(vertical_unit(&[1, 1, 0]).is_none());
    }
}
