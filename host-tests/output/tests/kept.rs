//! Files that are there whole or not at all, written by one at a time.

use output::kept::{self, Lock, Whole};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{fs, thread};

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("kept").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| name(entry.unwrap())).collect();
    names.sort();
    names
}

#[test]
fn a_lock_is_one_at_a_time_though_its_file_comes_and_goes() {
    let folder = folder("locks");
    let path = folder.join("file");
    let inside = AtomicUsize::new(0);
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..100 {
                    let lock = Lock::wait(&path).unwrap();
                    assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                    thread::yield_now();
                    inside.fetch_sub(1, Ordering::SeqCst);
                    drop(lock);
                }
            });
        }
    });
    let lock = Lock::take(&path).unwrap();
    let told = Lock::take(&path).unwrap_err().to_string();
    assert!(told.contains("is being written by this process itself"), "{told}");
    drop(lock);
    assert_eq!(names(&folder), [""; 0]);
}

#[test]
fn what_is_not_finished_leaves_the_old_file() {
    let folder = folder("unfinished");
    let path = folder.join("file");
    kept::write(&path, "old").unwrap();
    let mut whole = Whole::create(&path).unwrap();
    whole.write_all(b"half").unwrap();
    assert_eq!(names(&folder), ["file", "file.lock", "file.new"]);
    drop(whole);
    assert_eq!((names(&folder), fs::read_to_string(&path).unwrap()), (vec!["file".to_owned()], "old".to_owned()));
    let mut whole = Whole::create(&path).unwrap();
    whole.write_all(b"new").unwrap();
    whole.finish().unwrap();
    assert_eq!((names(&folder), fs::read_to_string(&path).unwrap()), (vec!["file".to_owned()], "new".to_owned()));
}

#[test]
#[cfg(target_os = "linux")]
fn links_rights_and_devices_are_left_as_they_are() {
    use std::os::unix::fs::{PermissionsExt as _, symlink};
    let folder = folder("links");
    let (path, link) = (folder.join("file"), folder.join("link"));
    kept::write(&path, "old").unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
    symlink(&path, &link).unwrap();
    kept::write(&link, "new").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    kept::write(Path::new("/dev/null"), "nothing").unwrap();
    assert!(kept::write(Path::new("/dev/full"), "something").unwrap_err().to_string().contains("No space left"));
    assert!(!Path::new("/dev/full.lock").exists());
    assert!(kept::write(&folder, "a folder").is_err());
    assert!(kept::write(&folder.join("nowhere/file"), "").is_err());
}
