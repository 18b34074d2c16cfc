//! `[[stock]]` and `[[fixture]]`. In: these tables of the setup. Out: stock and keep-out boxes as types of [`crate::machine`].

use super::file::{BoxTable, CylinderTable, SetupFile, StockTable};
use super::machine::{OFFSET_NAMES, offset_number};
use super::material::{material, named_material};
use super::read::{Reader, Sense};
use crate::machine::{Box3, Material, Stock, StockShape, Tool};
use crate::path::Vec3;
use crate::units::Dimension;
use std::path::Path;

/// All pieces of stock.
pub fn stocks(reader: &mut Reader, file: &SetupFile, tools: &[Tool], dir: &Path, is_for_table: bool) -> Vec<Stock> {
    let tables = file.stock.as_ref().map_or(&[][..], |written| written.as_slice());
    if tables.is_empty() && is_for_table {
        return of_material_alone(reader, file);
    }
    if tables.is_empty() {
        reader.missing("stock", "write [stock] with box = { min = [x, y, z], max = [x, y, z] } in work coordinates");
    }
    let written = file.material.as_ref().map(|table| material(reader, "material", table));
    let many = tables.len() > 1;
    let one = |(index, table): (usize, &StockTable)| {
        let key = if many { format!("stock[{}]", index + 1) } else { "stock".to_owned() };
        let material = written.clone().or_else(|| of_stock(reader, &key, table, tools));
        Some(Stock {
            shape: shape(reader, &key, table, dir)?,
            offset: table.offset.as_deref().and_then(|name| offset(reader, &key, name)),
            moved_mm: Vec3::zeros(),
            material: material?,
            uncertainty_mm: reader.or(
                &format!("{key}.uncertainty"),
                table.uncertainty.as_ref(),
                Dimension::Length,
                Sense::NotNegative,
                0.5,
            ),
        })
    };
    tables.iter().enumerate().filter_map(one).collect()
}

/// For a table of steady cuts, which brings its own geometry: the material, on a stock of no meaning, or nothing.
fn of_material_alone(reader: &mut Reader, file: &SetupFile) -> Vec<Stock> {
    let stock = |material| Stock {
        shape: StockShape::Box(Box3 { min: Vec3::zeros(), max: Vec3::new(1.0, 1.0, 1.0) }),
        offset: None,
        moved_mm: Vec3::zeros(),
        material,
        uncertainty_mm: 0.0,
    };
    file.material.iter().map(|table| stock(material(reader, "material", table))).collect()
}

fn of_stock(reader: &mut Reader, key: &str, table: &StockTable, tools: &[Tool]) -> Option<Material> {
    if let Some(name) = &table.material {
        return named_material(reader, &format!("{key}.material"), name);
    }
    let every_tool = !tools.is_empty() && tools.iter().all(|tool| tool.coefficients.is_some() || tool.is_frozen());
    let own = tools.iter().find_map(|tool| tool.coefficients.clone());
    if !every_tool || own.is_none() {
        reader.missing(
            &format!("{key}.material"),
            "name a material of `feedwright library materials`, or write a [material] table",
        );
        return None;
    }
    own
}

fn offset(reader: &mut Reader, key: &str, name: &str) -> Option<u16> {
    let number = offset_number(name);
    if number.is_none() {
        reader.complain(&format!("{key}.offset"), format!("\"{name}\" is no work offset"), OFFSET_NAMES);
    }
    number
}

fn shape(reader: &mut Reader, key: &str, table: &StockTable, dir: &Path) -> Option<StockShape> {
    let mut shapes = Vec::new();
    if let Some(written) = &table.block {
        shapes.push(StockShape::Box(box3(reader, &format!("{key}.box"), written)));
    }
    if let Some(written) = &table.cylinder {
        shapes.push(cylinder(reader, &format!("{key}.cylinder"), written));
    }
    shapes.extend(table.stl.as_ref().map(|name| StockShape::Stl(dir.join(name))));
    shapes.extend(table.saved.as_ref().map(|name| StockShape::Saved(dir.join(name))));
    if shapes.len() != 1 {
        reader.complain(
            key,
            "needs exactly one of box, cylinder, stl, saved",
            "write box = { min = [x, y, z], max = [x, y, z] }",
        );
        return None;
    }
    shapes.pop()
}

/// A box with its corners in order.
pub fn box3(reader: &mut Reader, key: &str, table: &BoxTable) -> Box3 {
    let min = reader.point(&format!("{key}.min"), &table.min);
    let max = reader.point(&format!("{key}.max"), &table.max);
    if (0..3).any(|axis| min[axis] >= max[axis]) {
        reader.complain(key, "has no volume", "each coordinate of max must be above that of min");
        return Box3 { min, max: min + Vec3::repeat(1.0) };
    }
    Box3 { min, max }
}

fn cylinder(reader: &mut Reader, key: &str, table: &CylinderTable) -> StockShape {
    let mut coordinate = |name: &str, q| reader.value(&format!("{key}.{name}"), q, Dimension::Length, Sense::Any);
    let centre = [coordinate("center", &table.center[0]), coordinate("center", &table.center[1])];
    let z_mm = [coordinate("z", &table.z[0]), coordinate("z", &table.z[1])];
    if z_mm[0] >= z_mm[1] {
        reader.complain(&format!("{key}.z"), "has no height", "write the lower face first");
    }
    let diameter_mm = reader.value(&format!("{key}.diameter"), &table.diameter, Dimension::Length, Sense::Positive);
    StockShape::Cylinder { centre, diameter_mm, z_mm }
}
