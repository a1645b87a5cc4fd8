//! In: rows of named columns. Out: a Parquet file: one group of rows after the other, without compression; equal rows
//! give equal bytes.
//! Frame and unit: as the columns' names say.

use crate::fault::{Fault, Result};
use crate::files::{Aside, moment};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows that are held in memory until they are written.
const GROUP: usize = 65_536;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Text,
    Whole,
    Real,
    Truth,
}

/// A value of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    Text(String),
    Whole(u64),
    Real(f64),
    Truth(bool),
    Nothing,
}

/// Values of a column in the group under way; `present` says of each row whether there is one.
enum Values {
    Text(Vec<ByteArray>),
    Whole(Vec<i64>),
    Real(Vec<f64>),
    Truth(Vec<bool>),
}

struct Column {
    values: Values,
    present: Vec<i16>,
}

/// A file under way; it has its name when it is closed.
pub(super) struct ParquetFile {
    path: PathBuf,
    aside: Aside,
    writer: SerializedFileWriter<File>,
    columns: Vec<Column>,
    rows: u64,
}

impl ParquetFile {
    /// An empty table with these columns. Every value may be absent.
    pub fn create(path: &Path, name: &str, columns: &[(&str, Kind)]) -> Result<ParquetFile> {
        let aside = Aside::create(path)?;
        let file = aside.file().try_clone().map_err(|e| Fault::write(path, e))?;
        let program = format!("sheetlight {}", env!("CARGO_PKG_VERSION"));
        let about = KeyValue::new("sheetlight".into(), format!("{{\"table\":\"{name}\",\"units\":\"mm, degrees\"}}"));
        let properties = WriterProperties::builder().set_created_by(program).set_key_value_metadata(Some(vec![about]));
        let writer = schema(name, columns)
            .and_then(|s| SerializedFileWriter::new(file, Arc::new(s), Arc::new(properties.build())))
            .map_err(|e| fault(path, e))?;
        let columns = columns.iter().map(|(_, kind)| Column::of(*kind)).collect();
        Ok(ParquetFile { path: path.to_owned(), aside, writer, columns, rows: 0 })
    }

    /// Adds a row: a value for each column.
    pub fn push(&mut self, row: Vec<Cell>) -> Result<()> {
        assert_eq!(row.len(), self.columns.len(), "{}: a value for each column", self.path.display());
        self.columns.iter_mut().zip(row).for_each(|(column, cell)| column.push(cell));
        self.rows += 1;
        if self.columns[0].present.len() == GROUP { self.flush() } else { Ok(()) }
    }

    /// Rows so far.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    fn flush(&mut self) -> Result<()> {
        if self.columns[0].present.is_empty() {
            return Ok(());
        }
        let full = |e| Fault::write(&self.path, e);
        moment().map_err(full)?;
        let columns = &mut self.columns;
        let written = self.writer.next_row_group().and_then(|group| write(group, columns));
        written.map_err(|e| fault(&self.path, e))
    }

    /// Writes what is left and waits until the file is on the disk under its name.
    pub fn close(mut self) -> Result<()> {
        self.flush()?;
        moment().map_err(|e| Fault::write(&self.path, e))?;
        self.writer.close().map_err(|e| fault(&self.path, e))?;
        self.aside.keep()
    }
}

impl Column {
    fn of(kind: Kind) -> Column {
        let values = match kind {
            Kind::Text => Values::Text(Vec::new()),
            Kind::Whole => Values::Whole(Vec::new()),
            Kind::Real => Values::Real(Vec::new()),
            Kind::Truth => Values::Truth(Vec::new()),
        };
        Column { values, present: Vec::new() }
    }

    fn push(&mut self, cell: Cell) {
        self.present.push(i16::from(cell != Cell::Nothing));
        match (&mut self.values, cell) {
            (_, Cell::Nothing) => {}
            (Values::Text(all), Cell::Text(v)) => all.push(ByteArray::from(v.into_bytes())),
            (Values::Whole(all), Cell::Whole(v)) => all.push(i64::try_from(v).expect("counts are below 2^63")),
            (Values::Real(all), Cell::Real(v)) => all.push(v),
            (Values::Truth(all), Cell::Truth(v)) => all.push(v),
            (_, cell) => panic!("{cell:?} is of another kind than its column"),
        }
    }
}

fn write(
    mut group: SerializedRowGroupWriter<'_, File>,
    columns: &mut [Column],
) -> std::result::Result<(), ParquetError> {
    for column in columns {
        let mut to = group.next_column()?.expect("as many as the schema has");
        let present = Some(column.present.as_slice());
        match (to.untyped(), &mut column.values) {
            (ColumnWriter::ByteArrayColumnWriter(w), Values::Text(v)) => {
                w.write_batch(v, present, None).map(|_| v.clear())
            }
            (ColumnWriter::Int64ColumnWriter(w), Values::Whole(v)) => {
                w.write_batch(v, present, None).map(|_| v.clear())
            }
            (ColumnWriter::DoubleColumnWriter(w), Values::Real(v)) => {
                w.write_batch(v, present, None).map(|_| v.clear())
            }
            (ColumnWriter::BoolColumnWriter(w), Values::Truth(v)) => w.write_batch(v, present, None).map(|_| v.clear()),
            _ => unreachable!("the schema was made of these columns"),
        }?;
        column.present.clear();
        to.close()?;
    }
    group.close().map(|_| ())
}

fn schema(name: &str, columns: &[(&str, Kind)]) -> std::result::Result<Type, ParquetError> {
    let field = |(name, kind): &(&str, Kind)| {
        let physical = match kind {
            Kind::Text => Physical::BYTE_ARRAY,
            Kind::Whole => Physical::INT64,
            Kind::Real => Physical::DOUBLE,
            Kind::Truth => Physical::BOOLEAN,
        };
        let text = (*kind == Kind::Text).then_some(LogicalType::String);
        let field = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
        field.with_logical_type(text).build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<std::result::Result<Vec<_>, _>>()?;
    Type::group_type_builder(name).with_fields(fields).build()
}

fn fault(path: &Path, e: ParquetError) -> Fault {
    let e = match e {
        ParquetError::External(e) => e.downcast::<std::io::Error>().map_or_else(std::io::Error::other, |e| *e),
        e => std::io::Error::other(e.to_string()),
    };
    Fault::write(path, e)
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};

    #[test]
    fn rows_come_back_over_several_groups_and_their_bytes_are_the_same() {
        let dir = tempfile::tempdir().unwrap();
        let columns = [("name", Kind::Text), ("n", Kind::Whole), ("x_mm", Kind::Real), ("passed", Kind::Truth)];
        let rows = GROUP + 3;
        let make = |name: &str| {
            let path = dir.path().join(name);
            let mut file = ParquetFile::create(&path, "things", &columns).unwrap();
            for k in 0..rows {
                let name = if k % 3 == 0 { Cell::Nothing } else { Cell::Text(format!("name {k}")) };
                let x = if k % 2 == 0 { Cell::Real(k as f64 / 3.0) } else { Cell::Nothing };
                file.push(vec![name, Cell::Whole(k as u64), x, Cell::Truth(k % 5 == 0)]).unwrap();
            }
            assert!(!path.exists(), "it has its name only when it is whole");
            file.close().unwrap();
            std::fs::read(&path).unwrap()
        };
        assert!(make("a") == make("b"));
        let reader = SerializedFileReader::new(File::open(dir.path().join("a")).unwrap()).unwrap();
        assert_eq!(
            (reader.metadata().num_row_groups(), reader.metadata().file_metadata().num_rows()),
            (2, rows as i64)
        );
        for (k, row) in reader.get_row_iter(None).unwrap().enumerate() {
            let text = row.unwrap().to_string();
            let name = if k % 3 == 0 { "null".to_owned() } else { format!("\"name {k}\"") };
            assert!(text.starts_with(&format!("{{name: {name}, n: {k}, ")), "{text}");
            assert!(text.ends_with(&format!("passed: {}}}", k % 5 == 0)), "{text}");
        }
    }
}
