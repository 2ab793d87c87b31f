//! A finger of somebody else: an array of 8 x 8 under the core as a package.

#[test]
fn an_array_of_8_x_8_holds_1_n() -> Result<(), fingertip::config::ConfigError> {
    use fingertip::command::Command;
    use fingertip::config::Shaped;
    use fingertip::fixed::types::{I8F24, I16F16};
    use fingertip::frame::{Frame, Sense};
    use fingertip::params::Params;
    use fingertip::pipeline::Pipeline;
    use fingertip::shipped::CLOCKS;
    use fingertip::units::{Millimetres, Newtons};

    const ROWS: usize = 8;
    const COLUMNS: usize = 8;
    let config = Shaped::<ROWS, COLUMNS>::new(&Params { pitch_um: 1_900, ..Params::DEFAULT }, &CLOCKS)?;
    let mut finger = Pipeline::new(&config);
    let mut command = Command { tare_request: 1, ..Command::default() };
    let (mut travel_mm, mut speed_mm_per_s) = (0.0, 0.0);
    for sequence in 1..=3_000 {
        // The array under a tip that presses on a plate 1 mm away; the encoder and the supply.
        let depth = Millimetres(I8F24::from_num(f64::max(travel_mm - 1.0, 0.0)));
        let mut frame = Frame { sequence, ..Frame::EMPTY };
        for (slot, column) in (0..=ROWS).flat_map(|slot| (0..COLUMNS).map(move |column| (slot, column))) {
            let mm = |place: usize, count: usize| 1.9 * (place as f64 - (count - 1) as f64 / 2.0);
            let distance = Millimetres(I8F24::from_num(mm(slot, ROWS).hypot(mm(column, COLUMNS))));
            let code = 40.0 + 24.0 * config.tip.pressure(distance, depth).0.to_num::<f64>();
            frame.set_code(slot, column, 372 + if slot < ROWS { code as u16 } else { 0 });
        }
        let sense = Sense { encoder: (travel_mm * 912.4) as i32, supply_mv: 6_500, ..Sense::default() };

        let (duty, status) = finger.step(&frame, &sense, &command);

        // The motor: 43 mm/s a volt, with a time constant of 7 ms; a frame takes 0.1 ms.
        let volts = 6.5 * f64::from(duty.0) / 32_767.0;
        speed_mm_per_s += (43.0 * volts - speed_mm_per_s) * 0.1 / 7.0;
        travel_mm += speed_mm_per_s * 1e-4;
        command.torque = sequence > 200; // after the tare
        command.goal = Newtons(I16F16::from_num(1));
        assert_eq!(status.fault, None);
    }
    let force_n = finger.status().contact.force.0.to_num::<f64>();
    assert!((force_n - 1.0).abs() < 0.02, "{force_n} N");
    Ok(())
}
