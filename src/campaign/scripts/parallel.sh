#!/bin/bash
# --resume goes on where a machine went down.
seq @SHARDS@ | parallel -q --resume --joblog parallel.log \
  misclosure campaign run @FOLDER@ --shard {}/@SHARDS@ --jobs @JOBS@
