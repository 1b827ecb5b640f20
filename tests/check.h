/*
  check.h - the few words our tests speak, over cmocka.

  A test is `static PetscErrorCode TestX(void)`, followed by CHECK_TEST(TestX); TEST(TestX) puts it in the list;
  CHECK_MAIN(list) is main, and runs the list between BaseInitialize and BaseFinalize.
*/
#pragma once
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>
#include "base.h"
#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#else
#define __lsan_disable() (void)0
#define __lsan_enable()  (void)0
#endif

#define CheckTrue(what) assert_true(what)
#define CheckInt(got, want) assert_int_equal((long long)(got), (long long)(want))
/* |got - want| <= tolerance, absolute */
#define CheckNear(got, want, tolerance) \
  do { \
    const double g_ = (double)(got), w_ = (double)(want), t_ = (double)(tolerance); \
    if (!(fabs(g_ - w_) <= t_)) fail_msg("%s = %.17g, expected %.17g +- %.3g", #got, g_, w_, t_); \
  } while (0)
/* relative to |want| */
#define CheckClose(got, want, relative) CheckNear(got, want, (relative) * fabs((double)(want)))
#define CheckBelow(got, bound) \
  do { \
    const double g_ = (double)(got), b_ = (double)(bound); \
    if (!(g_ <= b_)) fail_msg("%s = %.17g, expected at most %.3g", #got, g_, b_); \
  } while (0)
#define CheckPositive(got) \
  do { \
    const double g_ = (double)(got); \
    if (!(g_ > 0)) fail_msg("%s = %.17g, expected more than zero", #got, g_); \
  } while (0)
#define CheckAbove(got, bound) \
  do { \
    const double g_ = (double)(got), b_ = (double)(bound); \
    if (!(g_ >= b_)) fail_msg("%s = %.17g, expected at least %.3g", #got, g_, b_); \
  } while (0)
#define CheckContains(text, part) \
  do { \
    if (!strstr((text), (part))) fail_msg("'%s' does not contain '%s'", (text), (part)); \
  } while (0)
/* call returns `code` with a message that contains `part`. What it holds when it fails stays, as PETSc's errors have it: no leak. */
#define CheckFails(call, code, part) \
  do { \
    BaseErrorClear(); \
    BaseErrorQuiet(PETSC_TRUE); \
    __lsan_disable(); \
    const PetscErrorCode e_ = (call); \
    __lsan_enable(); \
    BaseErrorQuiet(PETSC_FALSE); \
    CheckInt(e_, code); \
    CheckContains(BaseErrorMessage(), part); \
  } while (0)

/* In main's list: `static const struct CMUnitTest tests[] = {TEST(TestX), ...};` after CHECK_TEST(TestX). */
#define TEST(function) {#function, CheckRun_##function, NULL, NULL, NULL}
#define CHECK_TEST(function) \
  static void CheckRun_##function(void **state) \
  { \
    (void)state; \
    assert_int_equal(function(), PETSC_SUCCESS); \
  }
#define CHECK_MAIN(tests) \
  int main(int argc, char **argv) \
  { \
    int failed; \
    if (BaseInitialize(&argc, &argv)) return 99; \
    failed = cmocka_run_group_tests_name(__FILE__, tests, NULL, NULL); \
    if (BaseFinalize()) return 98; \
    return failed; \
  }
