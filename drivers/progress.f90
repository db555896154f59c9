!! How far a program is: of a sweep a line that renews itself at a terminal, else a line now and then.
module progress
   use, intrinsic :: iso_fortran_env, only: error_unit
   use command_line, only: is_terminal
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: decimal
   implicit none(type, external)
   private

   public :: show_progress, show_work

   !> Tenths of the work that are reported where there is no terminal.
   integer, parameter :: reports = 10
   !> What takes longer is spoken of first after this time, s, then after as long as it has taken so far, at most the other.
   real(wp), parameter :: first_report = 2.0_wp, most_patience = 60.0_wp

contains

   !> Say how many of `total` points are done after `elapsed` s, and what time is left.
   subroutine show_progress(done, total, elapsed)
      integer(i8), intent(in) :: done, total
      real(wp), intent(in) :: elapsed

      integer(i8), save :: reported = 0
      character(120) :: line
      real(wp) :: left

      if (total == 0) return
      left = 0.0_wp
      if (done > 0) left = elapsed*real(total - done, wp)/real(done, wp)
      write (line, "(i0, a, i0, a)") done, " of ", total, " points, "//decimal(elapsed, 1)//" s, "//decimal(left, 1)//" s left"
      if (is_terminal()) then
         write (error_unit, "(a)", advance="no") achar(13)//line(:79)
         if (done == total) write (error_unit, "(a)") ""
      else if (done == total .or. (done*reports)/total > reported) then
         reported = (done*reports)/total
         write (error_unit, "(a)") trim(line)
      end if
      flush (error_unit)
   end subroutine show_progress

   !> Say now and then how far work is of which nobody knows how much it is; `elapsed` since it began, s.
   subroutine show_work(line, elapsed)
      character(*), intent(in) :: line
      real(wp), intent(in) :: elapsed

      real(wp), save :: next = first_report

      if (elapsed < next) return
      next = elapsed + min(elapsed, most_patience)
      write (error_unit, "(a)") line//", "//decimal(elapsed, 1)//" s"
      flush (error_unit)
   end subroutine show_work

end module progress
