//! The pass against plain arithmetic.

use super::*;

const ONE: f64 = (1_u64 << 32) as f64;

/// Calls a generic check with each of these array shapes, rows x columns.
macro_rules! shapes {
    ($check:ident: $($rows:literal x $columns:literal),+) => { $($check::<$rows, $columns>();)+ };
}

#[test]
fn the_boost_takes_the_sag_out() {
    let (mut ends, mut usual) = (0.0_f64, 0.0_f64);
    for x in (-1_370_000_000..=1_370_000_000).step_by(100_003) {
        let exact = f64::from(1 << BOOST_BITS) / (1.0 - f64::from(x) / ONE);
        let error = (f64::from(boost(x)) - exact).abs() / exact;
        ends = ends.max(error);
        if x.abs() < 300_000_000 {
            usual = usual.max(error);
        }
    }
    let unit = 1.0 / f64::from(1 << BOOST_BITS);
    assert!(ends < 1.2 / 1_048_576.0 && ends > 0.8 / 1_048_576.0, "{ends:e}");
    assert!(usual < 4.0 * unit && usual > unit, "{usual:e}");
}

/// Numbers that look like chance.
struct Mix(u32);

impl Mix {
    fn below(&mut self, limit: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(self.0) * u64::from(limit)) >> 32) as u32
    }
}

/// Codes, gains and tares at random, up to the top where `all` is.
fn bench<const ROWS: usize, const COLUMNS: usize>(
    mix: &mut Mix,
    top: bool,
) -> (Codes<ROWS, COLUMNS>, [Row<COLUMNS>; ROWS], Common) {
    let mut codes = Codes { rows: [[4_095; COLUMNS]; ROWS], undriven: [0; COLUMNS] };
    let mut row = Row { largest: 7, ..Row::new([32_767; COLUMNS], [0; COLUMNS]) };
    for column in 0..COLUMNS {
        let weight = (2 * column as i32 + 1 - COLUMNS as i32) * 32_767;
        row.moments[place(column, COLUMNS)] = (weight >> (14 - moment_bits(COLUMNS))) as i16;
    }
    let mut rows = [row; ROWS];
    // The largest sag that keeps the boost's range.
    let sag = (1_370_000_000 / (4_095 * COLUMNS as u32)).min(32_641);
    if !top {
        codes.rows.iter_mut().flatten().for_each(|code| *code = mix.below(4_096) as u16);
        codes.undriven.iter_mut().for_each(|code| *code = mix.below(300) as u16);
        for row in &mut rows {
            row.gains.iter_mut().for_each(|gain| *gain = mix.below(32_768) as i16);
            row.tare.iter_mut().for_each(|tare| *tare = mix.below(1 << 24) as i32 - (1 << 23));
        }
    }
    (codes, rows, Common { dead: 12 | 12 << 16, sag: sag | sag << 16, curve: Curve::LINE })
}

/// A pass against the same in wide integers, and against the portable one.
fn is_what_its_parts_say<const ROWS: usize, const COLUMNS: usize>(mix: &mut Mix, top: bool) {
    let (codes, mut rows, common) = bench::<ROWS, COLUMNS>(mix, top);
    let mut taxels = [[0; COLUMNS]; ROWS];
    let mut again = (rows, taxels);
    let total = pass(&codes, &mut rows, &common, &mut taxels, 0..ROWS, Total::ZERO);
    let split = mix.below(ROWS as u32 + 1) as usize;
    let parts = [0..split, split..ROWS]
        .into_iter()
        .fold(Total::ZERO, |total, range| portable_pass(&codes, &mut again.0, &common, &mut again.1, range, total));
    assert_eq!(parts, total);
    assert_eq!(again, (rows, taxels));
    let (drop, undriven) = (sum_drop(ROWS, COLUMNS), &codes.undriven);
    let (mut first, mut second, mut running, mut peak, mut all) = (0, 0, 0, 0, [0; 2]);
    for ((codes, row), taxels) in codes.rows.iter().zip(&rows).zip(taxels) {
        let net = |at: usize| i64::from(codes[at]) - i64::from(undriven[at]);
        let sag = i64::from(common.sag & 0xffff) * (0..COLUMNS).map(net).sum::<i64>();
        assert_eq!(row.boost, boost(i32::try_from(sag).expect("the sag fits")));
        let (mut largest, mut peak_of) = ([0; 2], 0);
        for (column, taxel) in taxels.into_iter().enumerate() {
            let at = place(column, COLUMNS);
            let exact = net(at) as f64 * f64::from(row.gains[at]) / 16_384.0 * f64::from(row.boost);
            let exact = 16.0 * exact / f64::from(1 << BOOST_BITS) - f64::from(row.tare[column] >> 12);
            assert!((f64::from(taxel) - exact).abs() <= 0.57, "{column}: {taxel}, not {exact}");
            peak_of = taxel.max(peak_of);
            let above = (net(at) - 12) as u16;
            largest[at % 2] = above.max(largest[at % 2]);
            if COLUMNS % 2 == 1 && at == COLUMNS - 1 {
                largest[1] = above.max(largest[1]);
            }
        }
        peak = peak_of.max(peak);
        assert_eq!(row.largest, pair(largest[0] as i16, largest[1] as i16), "{:x}", row.largest);
        all = [0, 1].map(|lane| largest[lane].max(all[lane]));
        let sum = |weights: &[i16; COLUMNS]| (0..COLUMNS).map(|at| net(at) * i64::from(weights[at])).sum::<i64>();
        // Eight pairs at a time lose the bits.
        let rest = |part: usize| {
            let places = 16 * part..COLUMNS.min(16 * part + 16);
            places.map(|at| net(at) * i64::from(row.gains[at])).sum::<i64>() >> drop
        };
        let dropped: i64 = (0..pairs(COLUMNS).div_ceil(8)).map(rest).sum();
        assert!((sum(&row.gains) >> drop).abs_diff(dropped) <= 1);
        first += (dropped * i64::from(row.boost)) >> 32;
        second += (sum(&row.moments) * i64::from(row.boost)) >> 32;
        running += first >> 2;
    }
    // These are exact, so no sum overflowed 32 bits. The running sum may wrap; the result computed from it is exact.
    assert_eq!([total.first, total.second].map(i64::from), [first, second]);
    assert_eq!(total.running, running as i32);
    i32::try_from((first >> 2) * (ROWS as i64 + 1) - 2 * running).expect("the moment fits");
    assert_eq!(total.peak, peak);
    assert_eq!(total.largest, pair(all[0] as i16, all[1] as i16), "{:x}", total.largest);
}

#[test]
fn a_pass_is_what_its_parts_say() {
    fn often<const ROWS: usize, const COLUMNS: usize>() {
        let mut mix = Mix(2_003);
        is_what_its_parts_say::<ROWS, COLUMNS>(&mut mix, true);
        (0..100).for_each(|_| is_what_its_parts_say::<ROWS, COLUMNS>(&mut mix, false));
    }
    shapes!(often: 3 x 3, 3 x 5, 4 x 4, 8 x 8, 10 x 10, 16 x 16, 16 x 17, 3 x 32, 16 x 3, 16 x 31, 16 x 32);
    assert_eq!([(10, 10), (16, 16), (16, 32)].map(|(rows, columns)| sum_drop(rows, columns)), [0, 1, 2]);
}

/// With a curve: each taxel is the formula of its codes, the sums are those of the taxels, and the reading stays known.
#[test]
fn a_pass_with_a_curve_is_its_formula() {
    fn curved<const ROWS: usize, const COLUMNS: usize>() {
        const PERMILLE: u32 = 2_000;
        let mut mix = Mix(7);
        for _ in 0..50 {
            let (codes, mut rows, common) = bench::<ROWS, COLUMNS>(&mut mix, false);
            let (mut line, mut taxels) = ([[0; COLUMNS]; ROWS], [[0; COLUMNS]; ROWS]);
            pass(&codes, &mut rows, &common, &mut line, 0..ROWS, Total::ZERO);
            let common = Common { curve: Curve::new(PERMILLE), ..common };
            let split = mix.below(ROWS as u32 + 1) as usize;
            let total = [0..split, split..ROWS]
                .into_iter()
                .fold(Total::ZERO, |total, range| pass(&codes, &mut rows, &common, &mut taxels, range, total));
            let (mut first, mut second, mut running) = (0, 0, 0);
            for ((row, line), taxels) in rows.iter().zip(line).zip(taxels) {
                for (column, taxel) in taxels.into_iter().enumerate() {
                    let tare = f64::from(row.tare[column]) / 65_536.0;
                    assert_eq!(row.reading(column), line[column]);
                    let formula = 16.0 * exact(PERMILLE, f64::from(line[column]) / 16.0, tare);
                    let formula = formula.min(f64::from((1 << Curve::LARGEST_BITS) - 1));
                    // The line is off by 1.6 sixteenths at most: its rounding, and its tare's cut. The curve's slope is 4.4 at most.
                    assert!((f64::from(taxel) - formula).abs() < 7.0, "{taxel}, not {formula}");
                    first += taxel;
                    second += taxel * (2 * column as i32 + 1 - COLUMNS as i32);
                }
                running += first;
            }
            assert_eq!([total.first, total.second, total.running], [first, second, running]);
        }
    }
    shapes!(curved: 3 x 3, 3 x 5, 4 x 4, 10 x 10, 16 x 32);
}

/// In codes.
fn exact(permille: u32, taxel: f64, tare: f64) -> f64 {
    let p = f64::from(permille) / 1_000.0;
    let least = 1.0 / (1.0 + p);
    taxel * (least + least * p * ((taxel + tare).max(0.0) + tare.max(0.0)) / 4_096.0)
}

#[test]
fn a_larger_reading_never_carries_less_and_the_full_range_stays() {
    for permille in [0, 1, 500, 1_000, 8_000] {
        let curve = Curve::new(permille);
        // The most that codes of 12 bits, gains below 2 and a boost below 1.5 can show.
        let most = 196_560;
        for tare in [-most, 0, 3_000, 65_536, most] {
            let all = (-most - tare..=most - tare).step_by(5).map(|taxel| curve.load(taxel << 6, tare << 12));
            assert!(all.clone().is_sorted(), "{permille} {tare}");
            assert!(all.clone().all(|carried| (-1 << 18..1 << 18).contains(&carried)));
            assert_eq!(curve.load(0, tare << 12), 0);
        }
        assert_eq!(curve.load(4_096 << 10, 0), 4_096 << 4, "{permille}");
    }
}
