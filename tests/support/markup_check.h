/* markup_check: what holds of every page: elements nest, ids are given once, nothing comes from outside,
 * and no drawing has a number that is none. For tests only. */
#ifndef FV_TESTS_MARKUP_CHECK_H
#define FV_TESTS_MARKUP_CHECK_H

#include <stdarg.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Every opened element is closed in its turn. */
static inline void markup_check_nesting(const char *html)
{
    static const char *const empty[] = {"!doctype", "meta", "link", "img", "br"};
    char open[64][24];
    int depth = 0;
    for (const char *tag = html; (tag = strchr(tag, '<'));) {
        bool closing = *++tag == '/';
        char name[24];
        tag += closing;
        size_t n = strcspn(tag, " >\n/");
        assert_true(n > 0 && n < sizeof name);
        memcpy(name, tag, n);
        name[n] = 0;
        const char *end = strchr(tag, '>');
        assert_non_null(end);
        bool alone = end[-1] == '/';
        for (size_t i = 0; i < sizeof empty / sizeof empty[0]; i++) alone |= strcmp(empty[i], name) == 0;
        if (closing) {
            assert_true(depth > 0);
            assert_string_equal(open[--depth], name);
        } else if (!alone) {
            assert_true(depth < 64);
            memcpy(open[depth++], name, sizeof name);
        }
        tag = end;
    }
    assert_int_equal(depth, 0);
}

/* The values of an attribute, in turn: NULL behind the last. Not thread-safe, not nested. */
static inline const char *markup_attribute(const char **at, const char *attribute)
{
    static char value[1 << 16];
    const char *from = strstr(*at, attribute);
    if (!from) return NULL;
    from += strlen(attribute);
    size_t n = strcspn(from, "\"");
    *at = from + n;
    if (n >= sizeof value) n = sizeof value - 1;
    memcpy(value, from, n);
    value[n] = 0;
    return value;
}

static inline void markup_check_inside(const char *html)
{
    static const char *const attributes[] = {" src=\"", " href=\"", "url("};
    const char *value;
    assert_null(strstr(html, "://"));
    assert_null(strstr(html, "<script"));
    assert_null(strstr(html, "@import"));
    for (size_t i = 0; i < sizeof attributes / sizeof attributes[0]; i++)
        for (const char *at = html; (value = markup_attribute(&at, attributes[i]));)
            if (strncmp(value, "data:", 5) != 0 && value[0] != '#') fail_msg("from outside: '%s'", value);
    for (const char *at = html; (value = markup_attribute(&at, " id=\""));) {
        char once[280];
        assert_true(strlen(value) < 256);
        snprintf(once, sizeof once, " id=\"%s\"", value);
        assert_null(strstr(at, once));
    }
}

static inline void markup_check_numbers(const char *html)
{
    static const char *const attributes[] = {" x=\"",  " y=\"",  " x1=\"", " x2=\"", " y1=\"",    " y2=\"",
                                             " cx=\"", " cy=\"", " d=\"",  " r=\"",  " style=\"", " dx=\""};
    const char *value;
    for (size_t i = 0; i < sizeof attributes / sizeof attributes[0]; i++)
        for (const char *at = html; (value = markup_attribute(&at, attributes[i]));)
            if (strstr(value, "nan") || strstr(value, "inf")) fail_msg("%s%s\"", attributes[i], value);
}

static inline void markup_check(const char *html)
{
    markup_check_nesting(html);
    markup_check_inside(html);
    markup_check_numbers(html);
}

#endif
