!! What was found of all motions, in sentences: which are stable where, where two of them exist beside each other and where
!! none does, and what happens at the values in between.
module razy_study_follow_summary
   use razy_core_kinds, only: wp
   use razy_core_number, only: counted, decimal, to_text
   use razy_core_text, only: append_text, string_t
   use razy_core_verdict, only: is_stable
   use razy_linalg_dense, only: rising_order
   use razy_orbits_branch_branch, only: branch_t
   use razy_study_follow_follow, only: follow_t
   implicit none(type, external)
   private

   public :: summary_of

   !> Stable motions of a branch, points `first` to `last` of it, over a range of the parameter.
   type :: stretch_t
      integer :: branch = 0, first = 0, last = 0
      real(wp) :: low = 0.0_wp, high = 0.0_wp
      !> It is one of the longest, which fit on a page.
      logical :: told = .false.
   end type stretch_t

   !> Ranges that are a smaller part of the whole are not spoken of.
   real(wp), parameter :: least_part = 1.0e-6_wp
   !> Of so many stretches all is told; of others, and of how many motions there are over less than this part of the range, nothing.
   integer, parameter :: most_told = 12
   real(wp), parameter :: least_told = 0.01_wp

contains

   !> The sentences, one a line.
   function summary_of(self) result(lines)
      type(follow_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      type(stretch_t), allocatable :: stretch(:)
      integer :: i, settled, unsettled

      allocate (lines(0))
      stretch = stable_stretches(self)
      associate (order => rising_order(stretch%low - stretch%high))
         stretch(order(:min(most_told, size(order))))%told = .true.
      end associate
      call append_text(lines, "Stable motions over "//self%varied(1)%parameter)
      do i = 1, size(stretch)
         if (.not. stretch(i)%told) cycle
         call append_text(lines, "  from "//value(self, stretch(i)%low)//" to "//with_unit(self, stretch(i)%high)//": "// &
                          counted(to_text(self%branch(stretch(i)%branch)%periods), "period")//", branch "// &
                          to_text(stretch(i)%branch))
      end do
      if (.not. all(stretch%told)) call append_text(lines, "  and "//to_text(count(.not. stretch%told))// &
                                                    " over shorter ranges, which are in the file")
      call tell_counts(self, stretch, lines)
      settled = sum([(sum(self%sample(i)%starts), i=1, size(self%sample))])
      unsettled = sum(self%sample%unsettled)
      call append_text(lines, "  of "//counted(to_text(settled + unsettled), "start")//" "//to_text(settled)// &
                       " settle to these, "//to_text(unsettled)//" to no motion of such a period")
      call append_text(lines, "What changes")
      call tell_changes(self, stretch, lines)
      do i = 1, size(self%sample)
         if (self%sample(i)%reason /= "") call append_text(lines, "At "//with_unit(self, self%sample(i)%parameter)// &
                                                           ": "//self%sample(i)%reason)
      end do
   end function summary_of

   !> All runs of stable motions, in the order of their lower ends; a located point at an end belongs to its run.
   pure function stable_stretches(self) result(stretch)
      type(follow_t), intent(in) :: self
      type(stretch_t), allocatable :: stretch(:)

      type(stretch_t) :: one
      integer :: b, i, k

      allocate (stretch(0))
      do b = 1, self%count
         associate (branch => self%branch(b))
            i = 1
            do while (i <= branch%count)
               k = i
               do while (k <= branch%count)
                  if (branch%point(k)%orbit%stability() /= is_stable) exit
                  k = k + 1
               end do
               if (k > i) then
                  one = stretch_t(b, max(1, i - borders(branch, i - 1)), min(branch%count, k - 1 + borders(branch, k)))
                  one%low = minval([(self%problem%value_of(branch%point(i)%orbit), i=one%first, one%last)])
                  one%high = maxval([(self%problem%value_of(branch%point(i)%orbit), i=one%first, one%last)])
                  if (one%high - one%low > least_part*self%problem%range) stretch = [stretch, one]
               end if
               i = k + 1
            end do
         end associate
      end do
      stretch = stretch(rising_order(stretch%low))
   end function stable_stretches

   !> 1 if point i exists and is a located one.
   pure integer function borders(branch, i)
      type(branch_t), intent(in) :: branch
      integer, intent(in) :: i

      borders = 0
      if (i >= 1 .and. i <= branch%count) borders = merge(1, 0, branch%point(i)%label /= "")
   end function borders

   !> Where there is more than one stable motion, and where none.
   subroutine tell_counts(self, stretch, lines)
      type(follow_t), intent(in) :: self
      type(stretch_t), intent(in) :: stretch(:)
      type(string_t), allocatable, intent(inout) :: lines(:)

      real(wp), allocatable :: at(:)
      real(wp) :: begun, middle
      integer :: before, count_here, i

      at = [self%first(1), self%last(1), stretch%low, stretch%high]
      at = at(rising_order(at))
      before = -1
      begun = at(1)
      do i = 2, size(at)
         if (at(i) - at(i - 1) <= least_part*self%problem%range) cycle
         middle = 0.5_wp*(at(i - 1) + at(i))
         count_here = count(stretch%low < middle .and. stretch%high > middle)
         if (count_here /= before) then
            call tell(self, before, begun, at(i - 1), lines)
            begun = at(i - 1)
         end if
         before = count_here
      end do
      call tell(self, before, begun, at(size(at)), lines)
   end subroutine tell_counts

   !> So many stable motions from a to b.
   subroutine tell(self, many, a, b, lines)
      type(follow_t), intent(in) :: self
      integer, intent(in) :: many
      real(wp), intent(in) :: a, b
      type(string_t), allocatable, intent(inout) :: lines(:)

      character(:), allocatable :: line
      integer :: i, k

      if (many == 1 .or. many < 0 .or. b - a < least_told*self%problem%range) return
      line = "  from "//value(self, a)//" to "//with_unit(self, b)//": "
      if (many > 1) then
         call append_text(lines, line//to_text(many)//" of them beside each other; which one is met depends on the start")
         return
      end if
      line = line//"none of up to "//counted(to_text(self%search%most_periods*2**self%doublings), "period")//" was found"
      k = 0
      do i = 1, size(self%sample)
         if (self%sample(i)%parameter < a .or. self%sample(i)%parameter > b) cycle
         if (k == 0) k = i
         if (self%sample(i)%exponent > self%sample(k)%exponent) k = i
      end do
      if (k > 0) then
         associate (sample => self%sample(k))
            if (sample%exponent > 3*sample%error) line = line//"; chaotic at "//with_unit(self, sample%parameter)// &
                                                         ", largest Lyapunov exponent "//decimal(sample%exponent, 3)//" 1/s"
         end associate
      end if
      call append_text(lines, line)
   end subroutine tell

   !> The located points of stable motions in the order of the parameter.
   subroutine tell_changes(self, stretch, lines)
      type(follow_t), intent(in) :: self
      type(stretch_t), intent(in) :: stretch(:)
      type(string_t), allocatable, intent(inout) :: lines(:)

      type(string_t), allocatable :: text(:)
      real(wp), allocatable :: at(:)
      character(:), allocatable :: words
      integer :: i, k

      allocate (at(0), text(0))
      do i = 1, size(stretch)
         if (.not. stretch(i)%told) cycle
         associate (branch => self%branch(stretch(i)%branch))
            do k = stretch(i)%first, stretch(i)%last
               words = change_at(self, branch, k)
               if (words == "") cycle
               at = [at, self%problem%value_of(branch%point(k)%orbit)]
               call append_text(text, "  at "//with_unit(self, at(size(at)))//": "//words//", branch "//to_text(stretch(i)%branch))
            end do
         end associate
      end do
      associate (order => rising_order(at))
         do i = 1, size(order)
            call append_text(lines, text(order(i))%text)
         end do
      end associate
   end subroutine tell_changes

   !> What happens at a point; empty if nothing does.
   function change_at(self, branch, i) result(words)
      type(follow_t), intent(in) :: self
      type(branch_t), intent(in) :: branch
      integer, intent(in) :: i
      character(:), allocatable :: words

      character(:), allocatable :: periods
      integer :: events(2), higher

      words = ""
      periods = counted(to_text(branch%periods), "period")
      associate (point => branch%point(i))
         select case (point%label)
         case ("LP")
            words = "the motion of "//periods//" ends in a fold; beyond it the machine jumps to another"
         case ("PD")
            words = "the motion of "//periods//" doubles its period"
         case ("TR")
            words = "a second frequency appears beside the motion of "//periods
         case ("BP")
            words = "other motions of "//periods//" branch off"
         case ("GR", "CH")
            if (i == 1 .or. i == branch%count) return
            ! Changes of contact in a motion, below and above this value; one more or less is no news.
            associate (before => branch%point(i - 1)%orbit, after => branch%point(i + 1)%orbit)
               higher = merge(1, 2, self%problem%value_of(before) > self%problem%value_of(after))
               events(higher) = before%sequence%count
               events(3 - higher) = after%sequence%count
            end associate
            words = self%contact_name(point%contact)
            if (words == "") words = "contacts"
            words = words//merge(" begins", " ceases", events(1) == 0)//" to touch or to part in the motion of "//periods
            if (events(1) > 0 .and. events(2) > 0) words = ""
         case ("ST", "SL")
            words = merge("sticking", "sliding ", point%label == "ST")
            words = trim(words)//" begins or ends at "//self%contact_name(point%contact)//" in the motion of "//periods
         case default
         end select
      end associate
   end function change_at

   !> A value of the parameter with digits down to a millionth of the range.
   pure function value(self, parameter) result(text)
      type(follow_t), intent(in) :: self
      real(wp), intent(in) :: parameter
      character(:), allocatable :: text

      text = decimal(parameter, max(0, 6 - floor(log10(self%problem%range))))
   end function value

   pure function with_unit(self, parameter) result(text)
      type(follow_t), intent(in) :: self
      real(wp), intent(in) :: parameter
      character(:), allocatable :: text

      text = value(self, parameter)
      if (self%varied(1)%unit /= "1") text = text//" "//self%varied(1)%unit
   end function with_unit

end module razy_study_follow_summary
