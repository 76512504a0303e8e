#!/bin/bash
export CAMPAIGN=@FOLDER@
hq submit --array 1-@SHARDS@ --cpus @JOBS@ --env CAMPAIGN="$CAMPAIGN" -- \
  bash -c 'misclosure campaign run "$CAMPAIGN" --shard "$HQ_TASK_ID"/@SHARDS@ --jobs @JOBS@'
