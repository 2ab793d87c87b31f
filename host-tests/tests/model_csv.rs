//! The model command: rows in, rows out, as a script would use it.

use std::io::Write;
use std::process::{Command, Output, Stdio};

/// Paths below are compiled in: by this they are compiled anew where the checkout was moved.
const _: &str = env!("FINGERTIP_ROOT");

const HEADER: &str = "a_mm,Y_kPa,d_mm,r_mm,rc_mm,theta_max_rad,p_kPa,F_N,k_N_per_mm,d_from_F_mm\n";

fn run(input: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_model"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    child.wait_with_output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

#[test]
fn columns_come_in_any_order_and_others_are_ignored() {
    let output = run("note,r_mm,d_mm,Y_kPa,a_mm\nfirst,0,2,250,10\nsecond,6.0,2.0,250.0,10.0\n");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let expected = format!(
        "{HEADER}{}{}",
        "10,250,2,0,6,0.6435011,50,3.14159,3.14159,1.999998\n",
        "10.0,250.0,2.0,6.0,6,0.6435011,0,3.14159,3.14159,1.999998\n"
    );
    assert_eq!(text(&output.stdout), expected);
    assert_eq!(text(&output.stderr), "");
}

#[test]
fn rows_outside_the_domain_are_named_and_left_empty() {
    let output = run(concat!(
        "a_mm,Y_kPa,d_mm,r_mm\n",
        "10,250,2,6\n",
        "3.99999999999,250,1,0\n",
        "16.00000001,250,1,0\n",
        "10,19.9,1,0\n",
        "10,2000.1,1,0\n",
        "10,250,0,0\n",
        "10,250,9.5000000001,0\n",
        "10,250,1,-0.1\n",
        "10,250,1,128\n",
        "10,250,one,0\n",
        "10,250,1e999999999,0\n",
        "10,250\n",
        "10,250,nan,0\n",
        "10,250,1,0\n",
    ));
    assert_eq!(output.status.code(), Some(1));
    let rows: Vec<&str> = text(&output.stdout).lines().skip(1).collect();
    assert_eq!(rows.len(), 14);
    let reasons: Vec<&str> = text(&output.stderr).lines().collect();
    let columns = ["a_mm", "a_mm", "Y_kPa", "Y_kPa", "d_mm", "d_mm", "r_mm", "r_mm", "d_mm", "d_mm", "d_mm", "d_mm"];
    assert_eq!(reasons.len(), columns.len(), "{reasons:?}");
    for (place, (reason, column)) in reasons.iter().zip(columns).enumerate() {
        assert!(reason.starts_with(&format!("row {}: {column} is ", place + 2)), "{reason}");
        assert!(rows[place + 1].ends_with(",,,,,,"), "{}", rows[place + 1]);
    }
    assert!(!rows[0].ends_with(',') && !rows[13].ends_with(','));
}

#[test]
fn the_domains_ends_are_inside() {
    let input = "a_mm,Y_kPa,d_mm,r_mm\n4,20,3.8,0\n16,2000,15.2,16\n7.3,20,6.935,127.9\n4,20,5.9604644775390625e-8,0\n";
    let output = run(input);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stdout).lines().count(), 5);
}

#[test]
fn a_missing_column_is_said() {
    let output = run("a_mm,d_mm,r_mm\n10,2,0\n");
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("no column Y_kPa"), "{}", text(&output.stderr));
    assert_eq!(text(&output.stdout), "");
}

#[test]
fn the_oracle_passes_through_within_the_bounds() {
    let oracle = std::fs::read_to_string(host_tests::prove::oracle::path()).unwrap();
    let output = run(&oracle);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let mut ours = csv::Reader::from_reader(output.stdout.as_slice());
    let mut theirs = csv::Reader::from_reader(oracle.as_bytes());
    let mut rows = 0;
    for (ours, theirs) in ours.records().zip(theirs.records()) {
        let (ours, theirs) = (ours.unwrap(), theirs.unwrap());
        let number = |record: &csv::StringRecord, place: usize| record[place].parse::<f64>().unwrap();
        // Units of the last place, and half a unit more for the decimals printed.
        for (place, (ulp, bound)) in [(24, 1.0), (24, 4.0), (16, 2.0), (16, 1.0), (16, 1.0)]
            .into_iter()
            .map(|(bits, b)| (0.5_f64.powi(bits), b))
            .enumerate()
        {
            let error = (number(&ours, 4 + place) - number(&theirs, 4 + place)) / ulp;
            assert!(error.abs() <= bound + 0.5, "row {rows}, column {}: {error} ulp", 4 + place);
        }
        rows += 1;
    }
    assert_eq!(rows, 400);
}
