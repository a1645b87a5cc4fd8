//! In: a camera as files write it. Out: the camera, and back. Five lens terms keep the key that files have always had;
//! a lens with more is written under a key that names its convention.
//! Frame and unit: px; docs/file-formats.md.

use super::{Distortion, Intrinsics};

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Written {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    skew: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    distortion_k1_k2_p1_p2_k3: Option<[f64; 5]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    distortion_opencv: Option<Vec<f64>>,
    width: u32,
    height: u32,
}

impl From<Intrinsics> for Written {
    fn from(k: Intrinsics) -> Written {
        let d = k.distortion;
        let brown = d.is_brown().then(|| [d[0], d[1], d[2], d[3], d[4]]);
        Written {
            fx: k.fx,
            fy: k.fy,
            cx: k.cx,
            cy: k.cy,
            skew: k.skew,
            distortion_opencv: brown.is_none().then(|| d.to_opencv().to_vec()),
            distortion_k1_k2_p1_p2_k3: brown,
            width: k.width,
            height: k.height,
        }
    }
}

impl TryFrom<Written> for Intrinsics {
    type Error = String;
    fn try_from(w: Written) -> Result<Intrinsics, String> {
        let distortion = match (w.distortion_k1_k2_p1_p2_k3, w.distortion_opencv) {
            (Some(brown), None) => brown.into(),
            (None, Some(terms)) => Distortion::from_opencv(&terms).ok_or_else(|| {
                format!("distortion_opencv has {} terms; OpenCV's lists have 4, 5, 8, 12 or 14", terms.len())
            })?,
            (None, None) => return Err("neither distortion_k1_k2_p1_p2_k3 nor distortion_opencv is there".into()),
            (Some(_), Some(_)) => {
                return Err("distortion_k1_k2_p1_p2_k3 and distortion_opencv are both there; which is meant?".into());
            }
        };
        let Written { fx, fy, cx, cy, skew, width, height, .. } = w;
        Ok(Intrinsics { fx, fy, cx, cy, skew, distortion, width, height })
    }
}
