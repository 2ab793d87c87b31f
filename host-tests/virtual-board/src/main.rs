//! `virtual-board`: the flash image on the emulated board.
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let mut rig = virtual_board::Rig::new(std::path::Path::new(&args[1]), host_tests::plant::World::new(&Default::default()), &Default::default()).unwrap();
    let ms: u64 = args[2].parse().unwrap();
    rig.run_ms(100).unwrap();
    let t = std::time::Instant::now();
    rig.run_ms(ms).unwrap();
    let w = t.elapsed().as_secs_f64();
    println!("ratio {:.3}", ms as f64 / 1000.0 / w);
    println!("{:?} {}", rig.scan_counts().unwrap(), rig.trace_hash().unwrap());
    rig.with(|s| { s.bench.latency.close(); println!("lat {} {}..{} {:?}", s.bench.latency.frames(), s.bench.latency.min_ns, s.bench.latency.max_ns, s.bench.bridge_edges);
      for l in &s.bench.log.lines { println!("{l:?}"); }
    for u in s.session.unmapped() { println!("  unmapped {u}"); }
    for (a, f) in s.session.refused() { println!("  refused {a:#x} {f:?}"); }
    for (a, f) in s.session.unimplemented() { println!("  unimplemented {a:#x} {f:?}"); }
    for u in s.session.unrouted() { println!("  unrouted {u:?}"); }
    for r in s.session.resets() { println!("  reset {r:?}"); }
    for t in s.session.told() { println!("  told {t:?}"); }
    let f = s.bench.front_end.lock(); println!("world {} mm {} N", f.world.travel_mm(), f.world.force_n());
    }).unwrap();
}
