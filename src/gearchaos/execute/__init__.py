"""Work items into results: in threads, in processes, on a cluster; knows no study."""
