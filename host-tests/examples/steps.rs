use fingertip::{config::*, params::Params, safety::Mode};
use host_tests::{native::Native, plant::Setup};
fn main() {
    let config = Config::new(&Params::DEFAULT).unwrap();
    println!("T {} ns kv {} k {} ", config.timing.frame_ns(), config.speed_gain_per_s, config.position_gain_per_s);
    let mut n = Native::new(&Setup::default(), &config);
    n.tare_and_enable();
    let verbose: usize = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(0);
    let steps: [(i32, f64); 7] = [(1000, 0.5), (200, 0.2), (2000, 0.2), (5000, 0.2), (1000, 0.2), (0, 0.3), (50, 0.6)];
    for (i, (mn, dur)) in steps.iter().enumerate() {
        n.command.goal = fingertip::config::newtons(*mn);
        let f0 = n.world.force_n();
        let g = *mn as f64 / 1e3;
        let t0 = n.time_s();
        let (mut peak, mut last_out, mut t10, mut t90) = (f0, t0, f64::NAN, f64::NAN);
        let mut k = 0;
        let mut st = n.step();
        let mut touch = f64::NAN;
        while n.time_s() - t0 < *dur {
            st = n.step();
            let f = n.world.force_n();
            let t = n.time_s();
            if f > 0.0 && touch.is_nan() {
                touch = t;
            }
            if (f - f0) / (g - f0) > 0.1 && t10.is_nan() {
                t10 = t
            }
            if (f - f0) / (g - f0) > 0.9 && t90.is_nan() {
                t90 = t
            }
            peak = if g > f0 { peak.max(f) } else { peak.min(f) };
            if (f - g).abs() > 0.02 * g {
                last_out = t
            }
            if i + 1 == verbose && k % 5 == 0 && k < 600 {
                println!(
                    "{:8.4} F {:.4} x {:.4} d {:.4} sens {:.4} v {:.2} vhat {:.2} duty {:6} w {:.0} lim {:03x} cur {:.2}",
                    t - t0,
                    f,
                    n.world.travel_mm(),
                    n.world.indentation_mm(),
                    st.contact.indentation.0,
                    n.world.speed_mm_per_s(),
                    st.speed.0,
                    st.duty.0,
                    f64::from(0.0),
                    st.limits.0,
                    n.world.current_a()
                );
            }
            k += 1;
        }
        println!(
            "{f0:.3} -> {g:.3}: mode {:?} fault {:?} final {:.4} sensed {:.4} err {:.2} mN  peak {:.4} ({:.2} %) rise {:.2} ms settle {:.2} ms touch {:.3} travel {:.3} lim {:x}",
            st.mode,
            st.fault,
            n.world.force_n(),
            st.contact.force.0.to_num::<f64>(),
            (n.world.force_n() - g) * 1e3,
            peak,
            (peak - g) / (g - f0) * 100.0,
            (t90 - t10) * 1e3,
            (last_out - t0) * 1e3,
            touch - t0,
            n.world.travel_mm(),
            st.limits.0
        );
        if g > 0.0 && f0 > 0.0 {
            let s = n.world.setup().clone();
            let t =
                host_tests::optimal::minimum_time_s(&s, s.tip.indentation_mm(f0), s.tip.indentation_mm(g), 6.0, 2.0)
                    .unwrap();
            println!("   optimal {:.2} ms ratio {:.2}", t * 1e3, (last_out - t0) / t);
        }
        if st.mode == Mode::Fault {
            break;
        }
    }
}
