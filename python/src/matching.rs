//! Parts in pictures: templates, and where they lie.

use crate::arrays::picture;
use crate::fault::{OrRaise, raised};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use sheetlight::fault::Fault;
use sheetlight::find::{self, Accelerator, Area, ModelOptions, Scene, SearchOptions, Weak, find_taught};
use sheetlight::raster::{Image, Pixels};
use sheetlight::rig::hash_text;
use std::path::PathBuf;

/// A part as a picture shows it.
#[pyclass(frozen, module = "sheetlight")]
pub struct Template(find::Template);

#[pymethods]
impl Template {
    /// Learns what `region` (x, y, width, height in px; without it all) of a picture (rows x columns) shows.
    /// `contrast` is the weakest edge as a share of the strong ones. Raises SheetlightError for a region without a
    /// clear outline.
    #[staticmethod]
    #[pyo3(signature = (name, picture, region = None, *, bits = None, contrast = None))]
    fn teach(
        py: Python<'_>,
        name: &str,
        picture: &Bound<'_, PyAny>,
        region: Option<[u32; 4]>,
        bits: Option<u8>,
        contrast: Option<f64>,
    ) -> PyResult<Template> {
        let image = self::picture(picture, bits, "the template's picture")?;
        let usual = ModelOptions::default();
        let options = ModelOptions { contrast: contrast.unwrap_or(usual.contrast), ..usual };
        let source = ("array".to_owned(), hash_of(&image));
        let learn = || find::Template::teach(name, &image, region, source, &options);
        Ok(Template(py.detach(learn).or_raise()?))
    }

    /// Reads what `sheetlight teach PICTURE --region` or save() wrote.
    #[staticmethod]
    fn load(file: PathBuf) -> PyResult<Template> {
        let text = std::fs::read_to_string(&file).map_err(|e| raised(Fault::read(&file, e)))?;
        Ok(Template(find::Template::parse(&text).map_err(|e| e.at(file.display())).or_raise()?))
    }

    /// The template as its file would have it (JSON).
    #[getter]
    fn text(&self) -> String {
        serde_json::to_string(&self.0).expect("plain data")
    }

    /// The part's name.
    #[getter]
    fn name(&self) -> String {
        self.0.name.clone()
    }

    fn __repr__(&self) -> String {
        format!("Template({:?}, {} edges)", self.0.name, self.0.model.levels[0].len())
    }
}

fn hash_of(image: &Image) -> String {
    match &image.pixels {
        Pixels::U8(levels) => hash_text(levels),
        Pixels::U16(levels) => hash_text(bytemuck::cast_slice(levels)),
    }
}

/// Finds a template in a picture (rows x columns), best first: a list of dicts with x_px, y_px (of the middle of its
/// region), angle_deg (x towards y), scale, score, sigma_px (2), sigma_deg, sigma_scale, edges, edge_rms_px,
/// second_score, correlation (of the grey levels, -1 to 1, or None) and warning. Nothing found is an empty list.
///
/// `weak_score` is the least score of matches whose correlation is 0.8 or more: 0.4 unless `min_score` is given.
/// `region` is (x, y, width, height) in px in which the middle lies. Raises SheetlightError for options out of range.
#[pyfunction]
#[pyo3(signature = (template, picture, *, angles_deg = None, scales = None, min_score = None, weak_score = None,
    most = 1, max_overlap = None, ignore_polarity = false, region = None, bits = None))]
pub fn match_template<'py>(
    py: Python<'py>,
    template: &Template,
    picture: &Bound<'_, PyAny>,
    angles_deg: Option<[f64; 2]>,
    scales: Option<[f64; 2]>,
    min_score: Option<f64>,
    weak_score: Option<f64>,
    most: usize,
    max_overlap: Option<f64>,
    ignore_polarity: bool,
    region: Option<[f64; 4]>,
    bits: Option<u8>,
) -> PyResult<Bound<'py, PyList>> {
    let image = self::picture(picture, bits, "the picture")?;
    let usual = SearchOptions::default();
    let options = SearchOptions {
        angles_deg: angles_deg.unwrap_or(usual.angles_deg),
        scales: scales.unwrap_or(usual.scales),
        min_score: min_score.unwrap_or(usual.min_score),
        max_overlap: max_overlap.unwrap_or(usual.max_overlap),
        ignore_polarity,
        ..usual.at_most(most)
    };
    options.check().or_raise()?;
    let usual = Weak::default();
    let weak_score = weak_score.or_else(|| min_score.is_none().then_some(usual.min_score));
    let weak = weak_score.map(|min_score| Weak { min_score, ..usual });
    let area = region.map(Area::rectangle).transpose().or_raise()?;
    let matches = py.detach(|| {
        let accelerator = Accelerator::open();
        let scene = Scene::from_image(&image);
        find_taught(&scene, &template.0, &options, weak.as_ref(), area.as_ref(), accelerator.as_ref())
    });
    let all = PyList::empty(py);
    for m in matches.or_raise()? {
        let one = PyDict::new(py);
        one.set_item("x_px", m.pose.x)?;
        one.set_item("y_px", m.pose.y)?;
        one.set_item("angle_deg", options.turn_deg(m.pose.angle))?;
        one.set_item("scale", m.pose.scale)?;
        one.set_item("score", m.score)?;
        one.set_item("sigma_px", m.sigma_px)?;
        one.set_item("sigma_deg", m.sigma_deg)?;
        one.set_item("sigma_scale", m.sigma_scale)?;
        one.set_item("edges", m.edges)?;
        one.set_item("edge_rms_px", m.edge_rms_px)?;
        one.set_item("second_score", m.second_score)?;
        one.set_item("correlation", m.correlation)?;
        one.set_item("warning", m.warning)?;
        all.append(one)?;
    }
    Ok(all)
}
