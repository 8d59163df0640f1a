//! Parquet: the long table, a row for each point of each frame.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;

use crate::sink::{Notes, Sink};
use crate::tables::{state, views};
use crate::{Point, Trial};

/// The columns, which are the same as in the long CSV.
const SCHEMA: &str = "message pose3d {
    REQUIRED INT64 frame;
    OPTIONAL DOUBLE time_s;
    OPTIONAL INT64 person;
    REQUIRED BYTE_ARRAY joint (UTF8);
    OPTIONAL DOUBLE x_m;
    OPTIONAL DOUBLE y_m;
    OPTIONAL DOUBLE z_m;
    OPTIONAL DOUBLE sd_m;
    OPTIONAL DOUBLE cov_xx_m2;
    OPTIONAL DOUBLE cov_xy_m2;
    OPTIONAL DOUBLE cov_xz_m2;
    OPTIONAL DOUBLE cov_yy_m2;
    OPTIONAL DOUBLE cov_yz_m2;
    OPTIONAL DOUBLE cov_zz_m2;
    OPTIONAL DOUBLE reprojection_px;
    REQUIRED BYTE_ARRAY views (UTF8);
    REQUIRED BYTE_ARRAY status (UTF8);
}";

/// Number of frames in a group of rows, which is assembled in memory.
const GROUP: usize = 2000;

pub(crate) fn write(trial: &Trial, out: &mut Sink<'_>) -> io::Result<Notes> {
    write_all(trial, out).map_err(|error| match error {
        ParquetError::External(cause) => match cause.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(other) => io::Error::other(other),
        },
        other => io::Error::other(other),
    })?;
    Ok(Notes::new())
}

fn write_all(trial: &Trial, out: &mut Sink<'_>) -> Result<(), ParquetError> {
    let schema = Arc::new(parse_message_type(SCHEMA)?);
    let properties = Arc::new(WriterProperties::builder().build());
    let mut file = SerializedFileWriter::new(out, schema, properties)?;
    let names: Vec<&str> = trial.names().collect();
    for begin in (0..trial.slots.len()).step_by(GROUP) {
        let end = (begin + GROUP).min(trial.slots.len());
        let places = (begin..end).flat_map(|slot| (0..names.len()).map(move |nth| (slot, nth)));
        let places: Vec<(usize, usize)> = places.collect();
        let mut group = file.next_row_group()?;
        let frames: Vec<i64> = places
            .iter()
            .map(|place| i64::try_from(trial.frame(place.0)).unwrap_or(i64::MAX))
            .collect();
        column::<Int64Type, _>(&mut group, &frames, None)?;
        numbers(&mut group, places.iter().map(|place| trial.time_s(place.0)))?;
        let ids = || places.iter().map(|place| trial.id_at(place.0));
        let known: Vec<i64> =
            ids().flatten().map(|id| i64::try_from(id).unwrap_or(i64::MAX)).collect();
        let levels: Vec<i16> = ids().map(|id| i16::from(id.is_some())).collect();
        column::<Int64Type, _>(&mut group, &known, Some(&levels))?;
        texts(
            &mut group,
            places.iter().map(|place| names[place.1].to_owned()),
        )?;
        let point = |place: &(usize, usize)| trial.point(place.0, place.1);
        for axis in 0..3 {
            numbers(
                &mut group,
                places.iter().map(|place| Some(point(place)?.in_world[axis])),
            )?;
        }
        numbers(
            &mut group,
            places.iter().map(|place| point(place)?.deviation_m()),
        )?;
        for entry in 0..6 {
            numbers(
                &mut group,
                places.iter().map(|place| Some(point(place)?.covariance[entry])),
            )?;
        }
        numbers(
            &mut group,
            places.iter().map(|place| point(place)?.reprojection_px),
        )?;
        let named = |point: &Point| views(trial, point);
        texts(
            &mut group,
            places.iter().map(|place| point(place).map_or(String::new(), named)),
        )?;
        let states = places.iter().map(|place| state(trial, place.0, place.1).to_owned());
        texts(&mut group, states)?;
        group.close()?;
    }
    file.close()?;
    Ok(())
}

/// Writes a column.
///
/// * `levels`: 1 if there is a value, 0 if there is none; `None` for a column without gaps.
fn column<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[T::T],
    levels: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let missing = || ParquetError::General("a column too many".to_owned());
    let mut column = group.next_column()?.ok_or_else(missing)?;
    column.typed::<T>().write_batch(values, levels, None)?;
    column.close()
}

fn numbers<W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    all: impl Iterator<Item = Option<f64>>,
) -> Result<(), ParquetError> {
    let all: Vec<Option<f64>> =
        all.map(|number| number.filter(|value| value.is_finite())).collect();
    let levels: Vec<i16> = all.iter().map(|value| i16::from(value.is_some())).collect();
    let values: Vec<f64> = all.into_iter().flatten().collect();
    column::<DoubleType, _>(group, &values, Some(&levels))
}

fn texts<W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    all: impl Iterator<Item = String>,
) -> Result<(), ParquetError> {
    let values: Vec<ByteArray> = all.map(|text| ByteArray::from(text.into_bytes())).collect();
    column::<ByteArrayType, _>(group, &values, None)
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::RowAccessor as _;

    use super::*;
    use crate::Gap;
    use crate::testing::walker;

    #[test]
    fn written_data_is_read_back() {
        let mut trial = walker(3);
        trial.slots[1].points[4] = Err(Gap("implausible".into()));
        let mut file = Vec::new();
        write(&trial, &mut file).unwrap();
        let mut on_disk = tempfile::tempfile().unwrap();
        on_disk.write_all(&file).unwrap();
        let reader = SerializedFileReader::new(on_disk).unwrap();
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 3 * 14);
        let due = trial.point(2, 13).unwrap().in_world;
        let last = rows.last().unwrap();
        assert_eq!(
            (last.get_long(0).unwrap(), last.get_string(3).unwrap()),
            (12, &"head".to_owned())
        );
        assert_eq!(last.get_double(5).unwrap(), due.z);
        let gap = &rows[14 + 4];
        assert_eq!(gap.get_string(15).unwrap(), "implausible");
        assert!(gap.get_double(3).is_err(), "no number");
    }
}
