!! The result file of a sweep, put together from the checkpoint part by part.
module sweep_result
   use, intrinsic :: iso_fortran_env, only: int32, int8
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_observe_contact_tally, only: quantities, quantity_meaning, quantity_name, quantity_unit
   use razy_motion_integrator, only: status_meanings
   use razy_io_header, only: result_header_t
   use razy_io_sweep_content, only: sweep_content_t
   use razy_io_sweep_file, only: sweep_writer_t
   use razy_study_motion_watch, only: motion_result_t
   use razy_sweep_task, only: point_result_t
   use sweep_attractors, only: find_attractors
   use sweep_case, only: sweep_task_t
   implicit none(type, external)
   private

   public :: write_results

   !> A part is written when it has so many points, or so many extrema of one observable.
   integer(i8), parameter :: part_points = 16384, part_extrema = 262144

contains

   !> Write the complete file in grid order; `failed` and `doubtful` are the numbers of points that failed, and that have doubts.
   subroutine write_results(task, path, header, overwrite, failed, doubtful, error)
      class(sweep_task_t), intent(inout) :: task
      character(*), intent(in) :: path
      type(result_header_t), intent(in) :: header
      logical, intent(in) :: overwrite
      integer(i8), intent(out) :: failed, doubtful
      type(error_t), allocatable, intent(out) :: error

      type(sweep_content_t) :: part
      type(sweep_writer_t) :: writer
      integer(i8) :: first, n

      failed = 0
      doubtful = 0
      call describe(task, part)
      call find_attractors(task, part%starts, error)
      if (allocated(error)) return
      call writer%begin(path, header, part, task%total, error)
      if (allocated(error)) return
      first = 1
      do while (first <= task%plan%points .and. .not. allocated(error))
         call read_part(task, first, part, n, error)
         if (.not. allocated(error)) call writer%put(part, error)
         failed = failed + count(part%status /= 0)
         doubtful = doubtful + count(part%doubts /= 0)
         first = first + n
      end do
      if (allocated(error)) then
         call writer%discard()
      else
         call writer%commit(overwrite, error)
      end if
   end subroutine write_results

   !> Axes, meanings, names and units.
   subroutine describe(task, content)
      class(sweep_task_t), intent(in) :: task
      type(sweep_content_t), intent(out) :: content

      integer :: i, k

      allocate (content%axes(size(task%varied)), content%extrema(size(task%watch%extrema)))
      allocate (content%contact_values(quantities*size(task%watch%contacts)))
      do i = 1, size(task%varied)
         content%axes(i)%parameter = task%varied(i)%parameter
         content%axes(i)%units = unit_text(task%varied(i)%unit)
         content%axes(i)%long_name = task%varied(i)%parameter
         content%axes(i)%values = task%grid%axes(i)%values()
      end do
      if (task%plan%has_chains()) content%directions = int(task%plan%directions, int8)
      content%status_meanings = [character(48) :: status_meanings]
      do i = 1, size(task%watch%extrema)
         associate (stored => content%extrema(i), observable => task%machine%observable(task%watch%extrema(i)%form))
            stored%name = observable%name
            stored%units = observable%unit
            stored%long_name = observable%long_name
         end associate
      end do
      do i = 1, size(task%watch%contacts)
         do k = 1, quantities
            associate (stored => content%contact_values((i - 1)*quantities + k), &
                       contact => task%machine%contact(task%watch%contacts(i)))
               stored%path = "/contact/"//contact%name//"/"//trim(quantity_name(k))
               stored%units = quantity_unit(contact, k)
               stored%long_name = contact%name//": "//trim(quantity_meaning(k))
            end associate
         end do
      end do
      if (.not. task%watch%asks_kind) return
      allocate (character(64) :: content%contact_names(size(task%machine%contact)))
      do i = 1, size(task%machine%contact)
         content%contact_names(i) = task%machine%contact(i)%name
      end do
   end subroutine describe

   !> Read the `n` points from `first` on that make a part.
   subroutine read_part(task, first, part, n, error)
      class(sweep_task_t), intent(inout) :: task
      integer(i8), intent(in) :: first
      type(sweep_content_t), intent(inout) :: part
      integer(i8), intent(out) :: n
      type(error_t), allocatable, intent(out) :: error

      type(point_result_t) :: result
      type(motion_result_t) :: motion
      integer(i8) :: most
      integer :: i

      most = min(part_points, task%plan%points - first + 1)
      call empty(part, most)
      n = 0
      do while (n < most)
         call task%result_at(first + n, result, motion, error)
         if (allocated(error)) return
         n = n + 1
         part%status(n) = int(motion%status, int32)
         part%events(n) = motion%events
         part%steps(n) = motion%steps
         part%doubts(n) = motion%doubts
         if (task%watch%asks_kind) then
            part%period(n) = int(motion%period, int32)
            part%touched(n) = motion%touched
         end if
         do i = 1, size(part%contact_values)
            part%contact_values(i)%values(n) = motion%statistics(1 + modulo(i - 1, quantities), 1 + (i - 1)/quantities)
         end do
         do i = 1, size(part%extrema)
            call append_extrema(part, i, n, result, motion)
         end do
         if (any([(part%extrema(i)%offset(n + 1), i=1, size(part%extrema))] >= part_extrema)) exit
      end do
      call trim_part(part, n)
   end subroutine read_part

   !> Make room for so many points.
   subroutine empty(part, points)
      type(sweep_content_t), intent(inout) :: part
      integer(i8), intent(in) :: points

      integer :: i

      if (allocated(part%status)) deallocate (part%status, part%events, part%steps, part%doubts)
      allocate (part%status(points), part%events(points), part%steps(points), part%doubts(points))
      if (allocated(part%period)) deallocate (part%period, part%touched)
      if (allocated(part%contact_names)) allocate (part%period(points), part%touched(points))
      do i = 1, size(part%contact_values)
         if (allocated(part%contact_values(i)%values)) deallocate (part%contact_values(i)%values)
         allocate (part%contact_values(i)%values(points))
      end do
      do i = 1, size(part%extrema)
         associate (extrema => part%extrema(i))
            if (allocated(extrema%offset)) deallocate (extrema%offset, extrema%value, extrema%time, extrema%kind)
            allocate (extrema%offset(points + 1), source=0_i8)
            allocate (extrema%value(1024), extrema%time(1024), extrema%kind(1024))
         end associate
      end do
   end subroutine empty

   !> Append the extrema of observable i at point n of the part.
   subroutine append_extrema(part, i, n, result, motion)
      type(sweep_content_t), intent(inout) :: part
      integer, intent(in) :: i
      integer(i8), intent(in) :: n
      type(point_result_t), intent(in) :: result
      type(motion_result_t), intent(in) :: motion

      integer(int8), allocatable :: kind(:)
      integer(i8) :: count, k, place, used

      associate (extrema => part%extrema(i))
         count = motion%count(i)
         place = motion%place(i)
         used = extrema%offset(n)
         if (used + count > size(extrema%value, kind=i8)) then
            call resize(extrema%value, 2*(used + count), used)
            call resize(extrema%time, 2*(used + count), used)
            allocate (kind(2*(used + count)))
            kind(:used) = extrema%kind(:used)
            call move_alloc(kind, extrema%kind)
         end if
         extrema%value(used + 1:used + count) = result%reals(place:place + count - 1)
         extrema%time(used + 1:used + count) = result%reals(place + count:place + 2*count - 1)
         do k = 1, count
            extrema%kind(used + k) = merge(motion%first_kind(i), -motion%first_kind(i), modulo(k, 2_i8) == 1)
         end do
         extrema%offset(n + 1) = used + count
      end associate
   end subroutine append_extrema

   !> Give all arrays the length of `points` points.
   subroutine trim_part(part, points)
      type(sweep_content_t), intent(inout) :: part
      integer(i8), intent(in) :: points

      integer(i8) :: used
      integer :: i

      part%status = part%status(:points)
      part%events = part%events(:points)
      part%steps = part%steps(:points)
      part%doubts = part%doubts(:points)
      if (allocated(part%period)) part%period = part%period(:points)
      if (allocated(part%touched)) part%touched = part%touched(:points)
      do i = 1, size(part%contact_values)
         call resize(part%contact_values(i)%values, points, points)
      end do
      do i = 1, size(part%extrema)
         associate (extrema => part%extrema(i))
            extrema%offset = extrema%offset(:points + 1)
            used = extrema%offset(points + 1)
            call resize(extrema%value, used, used)
            call resize(extrema%time, used, used)
            extrema%kind = extrema%kind(:used)
         end associate
      end do
   end subroutine trim_part

   !> Give the array another length, and keep the first `used` numbers.
   subroutine resize(array, length, used)
      real(wp), allocatable, intent(inout) :: array(:)
      integer(i8), intent(in) :: length, used

      real(wp), allocatable :: other(:)

      allocate (other(length))
      other(:used) = array(:used)
      call move_alloc(other, array)
   end subroutine resize

   !> A pure number has the unit 1.
   pure function unit_text(unit) result(text)
      character(*), intent(in) :: unit
      character(:), allocatable :: text

      text = unit
      if (len_trim(text) == 0) text = "1"
   end function unit_text

end module sweep_result
