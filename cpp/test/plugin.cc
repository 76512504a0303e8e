#include "effects/local-flaw.h"
