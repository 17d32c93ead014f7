/* Start of a self-test on a Cortex-M board of qemu: stack pointer and reset vector, then the C library. */
extern unsigned int os_stack_top;
extern void _start(void);
void os_reset(void);

__attribute__((section(".vectors"), used)) static void *const vectors[2] = {&os_stack_top, (void *)os_reset};

void os_reset(void)
{
    /* full access to the coprocessors 10 and 11, which are the floating-point unit */
    *(volatile unsigned int *)0xE000ED88U |= 0xFU << 20;
    __asm volatile("dsb\n\tisb");
    _start();
}
