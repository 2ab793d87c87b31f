//! Sweeps, shards and merging.

use crate::{WALL, folder, scene};
use sim::native;
use sim::sweep::{Plan, Shard, Table, merge, sweep};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Short, near, and with noise.
const SET: [&str; 3] = ["duration_s=0.04", "object.distance_mm=0.5", "effects.noise.rms_codes=1.5"];

/// Two keys and two seeds, short.
fn plan(out: &Path, shard: Shard) -> Plan {
    Plan {
        scene: WALL.into(),
        set: SET.map(String::from).into(),
        vary: vec!["tip.modulus_kpa=240..260:3".parse().unwrap(), "tip.radius_mm=9.5..10.5:2".parse().unwrap()],
        seeds: 2,
        shard,
        out: Some(out.into()),
    }
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let file = |path: PathBuf| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(path).unwrap());
    fs::read_dir(folder).unwrap().map(|entry| file(entry.unwrap().path())).collect()
}

fn whole(name: &str) -> (PathBuf, Table) {
    let out = folder(&format!("swept/{name}"));
    let (table, told) = sweep(&plan(&out, Shard::WHOLE), &native::board).unwrap();
    assert_eq!(told, out);
    (out, table)
}

#[test]
fn shards_merged_are_the_whole_byte_for_byte() {
    let (whole, table) = whole("whole");
    let expected = files(&whole);
    assert_eq!(expected.keys().collect::<Vec<_>>(), ["peak_force_n.svg", "runs.csv", "summary.csv"]);
    assert_eq!(table.rows.len(), 12);
    assert!(
        table.text().contains("tip.modulus_kpa = 240.0, tip.radius_mm = 9.5")
            || table.text().contains("tip.modulus_kpa = 240, ")
    );

    let shards = folder("swept/shards");
    // The last first: the order of the files does not count.
    for shard in (1..=4).rev() {
        sweep(&plan(&shards, Shard { number: shard, of: 4 }), &native::board).unwrap();
    }
    let parts: Vec<PathBuf> = (1..=4).rev().map(|shard| shards.join(format!("runs-{shard}-of-4.csv"))).collect();
    let merged = folder("swept/merged");
    assert_eq!(merge(&parts, &merged).unwrap(), table);
    assert_eq!(files(&merged), expected);

    // What cannot be merged is refused.
    let refused = |files: &[PathBuf]| merge(files, &folder("swept/refused")).unwrap_err().to_string();
    assert!(refused(&parts[1..]).contains("3 of 12 runs are missing, run 4 the first"), "{}", refused(&parts[1..]));
    assert!(refused(&[parts.clone(), vec![parts[0].clone()]].concat()).contains("there twice"));
    let other = folder("swept/other");
    sweep(&Plan { seeds: 1, ..plan(&other, Shard { number: 1, of: 2 }) }, &native::board).unwrap();
    assert!(refused(&[parts[0].clone(), other.join("runs-1-of-2.csv")]).contains("is of the sweep"));
    assert!(refused(&[whole.join("summary.csv")]).contains("is no shard"));
}

#[test]
fn runs_are_numbered_point_by_point_and_seed_by_seed() {
    let (_, table) = whole("order");
    let column = |name: &str| table.head.iter().position(|known| known == name).unwrap();
    let number = |row: &Vec<String>, name: &str| row[column(name)].parse::<f64>().unwrap();
    let shown = ["run", "tip.modulus_kpa", "tip.radius_mm", "seed"];
    let rows: Vec<_> = table.rows.iter().map(|row| shown.map(|name| number(row, name))).collect();
    let mut expected = Vec::new();
    for modulus_kpa in [240.0, 250.0, 260.0] {
        for radius_mm in [9.5, 10.5] {
            expected.extend([1.0, 2.0].map(|seed| [expected.len() as f64 + seed, modulus_kpa, radius_mm, seed]));
        }
    }
    assert_eq!(rows, expected);
    // A row has the values that were run.
    let row = &table.rows[7];
    let scene = scene(WALL, &[&SET[..], &["tip.modulus_kpa=250", "tip.radius_mm=10.5"]].concat(), Some(2));
    let mut last = sim::metrics::Meter::default();
    assert_eq!(row[column("digest")], native::board(&scene, &mut last).unwrap().digest);
}

#[test]
fn what_cannot_be_run_is_told() {
    let out = folder("swept/wrong");
    let plan = Plan { vary: vec!["tip.radius_mm=10..1000:2".parse().unwrap()], ..plan(&out, Shard::WHOLE) };
    assert!(sweep(&plan, &native::board).unwrap_err().to_string().contains("radius_mm"));
    let failing = sweep(&self::plan(&out, Shard::WHOLE), &|_, _| Err("the board burns".into()));
    assert!(failing.unwrap_err().to_string().contains("the board burns"));
}
